"""A surface and its offset as places that a tool can follow: nearest ones, and paths between."""
