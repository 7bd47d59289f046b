"""Smooth parametric patches g(u, v) of several kinds, cut into grids of E-cells."""
