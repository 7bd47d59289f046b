"""From a verdict to a motion: the order of the cells, and the configuration over each."""
