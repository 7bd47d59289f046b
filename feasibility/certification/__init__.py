"""The independent replay that must accept a motion before "feasible" is said."""
