"""Certified distances of bodies, compiled: at configurations, and along straight joint segments."""
