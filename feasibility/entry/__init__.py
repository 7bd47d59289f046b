"""Entry and exit of a motion over a surface: along the approach direction, from and to home."""
