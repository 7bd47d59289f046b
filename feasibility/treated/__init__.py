"""The share of the surface that a certified motion treats, and what it leaves untreated."""
