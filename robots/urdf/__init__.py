"""The check that every URDF passes before a native parser sees it: one tree, or one error
with all its faults.
"""
