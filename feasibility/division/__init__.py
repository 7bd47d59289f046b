"""The fewest patches that cover a surface, and the joint moves between them."""
