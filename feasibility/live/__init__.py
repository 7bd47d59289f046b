"""A page where one moves the part and turns limits, and the verdict follows."""
