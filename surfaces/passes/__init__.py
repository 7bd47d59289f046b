"""Parallel passes over a surface, at a stated distance: what a painter or a polisher runs."""
