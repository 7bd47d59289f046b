"""The PUMA 560 of the paper: its URDF, written by `tools/puma560.py`, and its limit sets."""
