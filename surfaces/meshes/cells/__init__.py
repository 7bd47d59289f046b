"""A mesh cut into connected E-cells of even area."""
