"""Causes: why cells are missed, by which constraint or by which cut, and by how much."""
