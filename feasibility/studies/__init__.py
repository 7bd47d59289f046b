"""Many cases on many processes, kept as they finish."""
