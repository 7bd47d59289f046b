"""What an arm is: a Pinocchio model of its free joints, a tool, and real limits."""
