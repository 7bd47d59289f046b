"""The PUMA 560 of the paper: its URDF, written by `robots.dh`, and its limit sets."""
