"""The shapes of an arm's links: exact ones for the judge, convex outer ones for the search, and
which pairs of links can meet at all.
"""
