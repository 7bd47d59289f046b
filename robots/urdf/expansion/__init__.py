"""xacro files into the URDF that they stand for, in a process of its own."""
