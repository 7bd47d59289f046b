"""Graph G as networkx has it: the cells of a surface, and what people draw and store them with."""

from __future__ import annotations

from collections.abc import ItemsView
from typing import Any

import networkx as nx
import numpy as np

from coverable.arrays import Mask
from surfaces.cells import Cells


class _Attributes(dict[str, Any]):
    """Attributes of a node or an edge: arrays by their keys, listed as text.

    Formats such as GraphML take plain values only. So `items`, which their writers go through, has
    the numbers of an array in a string, its rows parted by semicolons, and leaves None out.
    """

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled and copied as what they are."""
        return _Attributes, (dict(self),)

    def items(self) -> ItemsView[str, Any]:  # pyrefly: ignore[bad-override]
        """The attributes, in types that `networkx.write_graphml` accepts."""
        return {key: _plain(value) for key, value in super().items() if value is not None}.items()


def _plain(value: Any) -> Any:
    """An array or a tuple as text; other values as they are."""
    if not isinstance(value, (np.ndarray, tuple)):
        return value
    rows = np.atleast_2d(np.asarray(value)).tolist()
    return "; ".join(" ".join(repr(number) for number in row) for row in rows)


class CellGraph(nx.Graph):
    """A graph whose attributes `networkx.write_graphml` accepts, arrays among them."""

    node_attr_dict_factory = _Attributes
    edge_attr_dict_factory = _Attributes


def cell_graph(cells: Cells, covered: Mask) -> CellGraph:
    """The cells without any motion between them.

    Args:
        cells: of a surface.
        covered: (N,) those that the best motion visits.

    Returns:
        A node for each flat index of a cell: `point` (3,) m, its centre, and `normal` (3,), both in
        the world; `index`, its (row, column) on a grid; `covered`; `q` None.
    """
    graph = CellGraph()
    for k, (point, normal) in enumerate(zip(cells.centres, cells.normals, strict=True)):
        index = tuple(int(i) for i in cells.unravel(k))
        graph.add_node(k, point=point, normal=normal, index=index, covered=bool(covered[k]), q=None)
    return graph
