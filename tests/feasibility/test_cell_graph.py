"""Graph G as people draw and store it."""

from __future__ import annotations

import pickle

import networkx as nx
import numpy as np
import pytest
from small_cases import small_case, small_verdict

from feasibility.results import load_result, save_result


@pytest.fixture(params=["plate", "long plate", "greedy dome", "loaded", "pickled"])
def verdict(request, tmp_path):
    if request.param == "loaded":
        save_result(small_verdict("plate"), small_case("plate"), tmp_path / "a")
        return load_result(tmp_path / "a").verdict
    if request.param == "pickled":
        return pickle.loads(pickle.dumps(small_verdict("long plate")))
    return small_verdict(request.param)


def test_nodes_carry_what_people_draw_with(verdict) -> None:
    cells, nodes = verdict.cells, verdict.graph.nodes
    assert list(nodes) == list(range(len(cells)))
    assert np.array([nodes[k]["point"] for k in nodes]) == pytest.approx(cells.centres, abs=1e-12)
    assert np.array([nodes[k]["normal"] for k in nodes]) == pytest.approx(cells.normals, abs=1e-12)
    assert [nodes[k]["index"] for k in nodes] == [tuple(cells.unravel(k)) for k in nodes]
    assert [nodes[k]["covered"] for k in nodes] == verdict.covered.tolist()
    assert {type(i) for k in nodes for i in nodes[k]["index"]} == {int}


def test_networkx_writes_it_as_graphml(verdict, tmp_path) -> None:
    nx.write_graphml(verdict.graph, tmp_path / "g.graphml")
    back = nx.read_graphml(tmp_path / "g.graphml", node_type=int)
    assert set(back.edges) == set(verdict.graph.edges)
    for k, node in verdict.graph.nodes.items():
        assert back.nodes[k]["covered"] is node["covered"]
        assert [int(i) for i in back.nodes[k]["index"].split()] == list(node["index"])
        for key in ("point", "normal", "q"):
            if node[key] is None:
                assert key not in back.nodes[k]
            else:  # every digit
                assert [float(x) for x in back.nodes[k][key].split()] == node[key].tolist()
    for a, b, motion in verdict.graph.edges(data="motion"):
        rows = [[float(x) for x in row.split()] for row in back.edges[a, b]["motion"].split(";")]
        assert rows == motion.tolist()
