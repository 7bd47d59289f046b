"""Certified motions of the tool over the surface: what the search is made of."""
