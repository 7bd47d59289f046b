"""Where the surface may stand, and how few stations cover it."""
