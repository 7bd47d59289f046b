"""What the arm may hit: the bodies of links, tool, scene and surface, the pairs that are checked,
and certified bounds on their distances for the search.
"""
