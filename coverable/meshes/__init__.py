"""Meshes from untrusted files: STL, OBJ, PLY, OFF and GLB, each read by its own strict reader.

Every count is checked against the size of the file and a cap before memory is taken for it, every
number and index before it is used, and only the one file is opened, whatever it names. COLLADA, in
which robots bring their shapes, is read by trimesh after a count of what would become of it.

Shared by the packages, which know nothing of each other.
"""
