"""The paper's method, readable beside the paper: J-cells, Algorithm 1, Algorithm 2, tree T,
graph G.
"""
