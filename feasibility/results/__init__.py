"""Verdicts and trajectories as files."""
