"""What a search knows, as the prover reads it: the components of a roadmap."""

from __future__ import annotations

import numpy as np

from feasibility.roadmap.cuts.gaps import Component
from feasibility.roadmap.graph import COMPONENTS, EDGES, NODES, WAYPOINTS, Roadmap


def components_of(roadmap: Roadmap) -> list[Component]:
    """The components of a roadmap, the largest first: nodes and waypoints, and covered cells."""
    nodes, edges, rows, slots = roadmap.counters[[NODES, EDGES, WAYPOINTS, COMPONENTS]]
    if nodes == 0:
        return []
    root = roadmap.parent[:slots].copy()
    while (root[root] != root).any():
        root = root[root]
    at_nodes = root[roadmap.component[:nodes]]
    # The waypoints of the edges stand one edge after the other.
    counts = roadmap.edge_rows[:edges, 1]
    at_rows = np.repeat(at_nodes[roadmap.ends[:edges, 0]], counts)
    q = np.vstack([roadmap.q[:nodes], roadmap.waypoints[:rows]])
    label = np.concatenate([at_nodes, at_rows])
    order = np.argsort(label, kind="stable")
    kinds, starts = np.unique(label[order], return_index=True)
    found = [
        Component(part, roadmap.cover[kind].astype(bool))
        for kind, part in zip(kinds, np.split(q[order], starts[1:]), strict=True)
    ]
    return sorted(found, key=lambda component: -int(component.cover.sum()))
