"""B-spline and NURBS patches, and the control nets that they are read from."""
