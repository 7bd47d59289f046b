"""Faces of STEP files as triangles, through Open CASCADE in a process of its own."""
