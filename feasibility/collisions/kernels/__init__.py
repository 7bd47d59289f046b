"""Certified bounds on the distances of bodies, compiled: at configurations, and all along straight
joint segments. The search kernels call them by address.
"""
