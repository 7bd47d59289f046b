"""The PUMA 560 of the paper: its URDF, written by `tests/robots/dh.py`, and its limit sets."""
