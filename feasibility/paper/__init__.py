"""The paper's method, readable beside the paper: J-cells, Algorithms 1 and 2, tree T, graph G."""
