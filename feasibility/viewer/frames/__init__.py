"""Frames in a picture: world, base and TCP as triads, and a world that stands still."""
