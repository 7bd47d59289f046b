"""The judge of the roll: bounds between exact configurations, along curves and over a surface."""
