"""Splines: B-spline and NURBS patches, and those fitted to a formula or to a grid of points."""
