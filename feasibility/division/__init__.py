"""The fewest patches or runs of passes that cover a surface, and the moves between them."""
