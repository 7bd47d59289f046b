"""Poses as cells: a toolpath, or a set of points with normals, and the curves between them."""
