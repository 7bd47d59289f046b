"""Several patches joined along their seams into one surface."""
