"""Spline surfaces fitted to what users have: a formula of their own, or a grid of points."""
