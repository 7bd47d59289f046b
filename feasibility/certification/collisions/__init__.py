"""The judge of collisions: certified clearance of exact bodies along a motion."""
