"""Verdicts changed by hand: some cells missed, for causes of every kind."""

from collections.abc import Collection
from dataclasses import replace
from itertools import cycle

import numpy as np

from feasibility.verdict import Answer, Cause, CauseKind, Evidence, Verdict


def missing(verdict: Verdict, missed: Collection[int]) -> Verdict:
    """The same without some cells; causes take turns, a pair for each; the last cell has none."""
    causes = []
    for cell, kind in zip(sorted(missed)[:-1], cycle(CauseKind), strict=False):
        pair = ("shelf", f"link {cell}") if kind is CauseKind.COLLISION else None
        causes.append(Cause(cell, kind, proved=True, detail="made up", pair=pair))
    covered, graph = verdict.covered.copy(), verdict.graph.copy()
    covered[list(missed)] = False
    graph.remove_edges_from([edge for edge in graph.edges if set(edge) & set(missed)])
    for cell in missed:
        graph.nodes[cell]["q"] = None
    start = int(np.flatnonzero(covered)[0]) if covered.any() else None
    return replace(
        verdict, answer=Answer.INFEASIBLE, evidence=Evidence.EXHAUSTED, message="Made up.",
        covered=covered, causes=tuple(causes), graph=graph, n_edges=graph.number_of_edges(),
        start=start, witness=None, certificate=None, tree=None, components=(),
    )  # fmt: skip
