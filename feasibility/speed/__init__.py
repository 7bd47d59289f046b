"""Motions that hold a speed, or keep away from singularities, among all that are known."""
