"""What the search proves: boxes of joint values without a solution, cuts that no motion crosses."""
