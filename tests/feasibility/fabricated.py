"""Verdicts made up for the tests of pictures: real arms, real motions, no search."""

from __future__ import annotations

import itertools

import networkx as nx
import numpy as np

from feasibility import Task
from feasibility.verdict import Answer, Cause, CauseKind, Evidence, Verdict, Walk
from robots import Kinematics
from surfaces import sphere

STEPS = 13
DOME = sphere(radius=1.0, polar_deg=(10, 90), azimuth_deg=(10, 180), side="inside")
TASK = Task(standoff=0.005, cone_deg=45)
SEED = {"puma560": [0.5, -1.0, 0.5, 0.0, 0.3, 0.0]}


def follow(kinematics, q, target):
    """The configuration near q that puts the tool point onto the target."""
    q = np.array(q, dtype=float)
    for _ in range(100):
        error = target - kinematics.tool(q)[0]
        if np.linalg.norm(error) < 1e-10:
            return q
        jacobian, _ = kinematics.jacobians(q)
        q += jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + 1e-9 * np.eye(3), error)
    raise AssertionError("the fabricated motion does not exist; choose another seed")


def motion_between(kinematics, start, end, points):
    """(STEPS, n) from configuration to configuration along a line between two points."""
    t = np.linspace(0.0, 1.0, STEPS)[1:-1, None]
    rows = (1 - t) * start + t * end
    targets = (1 - t) * points[0] + t * points[1]
    between = [follow(kinematics, q, p) for q, p in zip(rows, targets, strict=True)]
    return np.array([start, *between, end])


def verdict_on(robot, cells, task=TASK, *, missed=(), causes=(), witness=False, seed=None):
    """Every cell but the missed ones reached from the first, by breadth-first steps."""
    kinematics = Kinematics(robot)
    points = task.targets(cells).points
    adjacency = cells.graph()
    graph = nx.Graph()
    graph.add_nodes_from(range(len(cells)), q=None)
    tree = nx.DiGraph()
    reached = [k for k in range(len(cells)) if k not in missed]
    start = reached[0] if reached else None
    if start is not None:
        graph.nodes[start]["q"] = follow(kinematics, seed or SEED[robot.name], points[start])
        tree.add_node(start)
        for a, b in nx.bfs_edges(adjacency.subgraph(reached), start):
            graph.nodes[b]["q"] = follow(kinematics, graph.nodes[a]["q"], points[b])
            tree.add_edge(a, b)
    covered = np.array([graph.nodes[k]["q"] is not None for k in range(len(cells))], dtype=bool)
    for a, b in adjacency.edges:
        if covered[a] and covered[b]:
            a, b = sorted((a, b))
            q = graph.nodes
            motion = motion_between(kinematics, q[a]["q"], q[b]["q"], points[[a, b]])
            graph.add_edge(a, b, motion=motion)
    done = bool(covered.all())
    walk = None
    if witness:
        path = max(nx.single_source_shortest_path(tree, start).values(), key=len)
        legs = [
            graph.edges[a, b]["motion"][:: 1 if a < b else -1] for a, b in itertools.pairwise(path)
        ]
        rows = np.concatenate([legs[0], *(leg[1:] for leg in legs[1:])])
        walk = Walk(rows, np.full(len(rows), -1))
    components = [np.array(sorted(part)) for part in nx.connected_components(graph)]
    return Verdict(
        answer=Answer.FEASIBLE if done else Answer.INFEASIBLE,
        evidence=Evidence.WITNESS if done else Evidence.EXHAUSTED,
        message="Made up for a test.",
        robot=robot,
        cells=cells,
        task=task,
        method="greedy",
        seed=0,
        graph=graph,
        n_edges=graph.number_of_edges(),
        covered=covered,
        causes=causes,
        components=tuple(sorted(components, key=len, reverse=True)),
        tree=tree,
        start=start,
        witness=walk,
    )


def every_cause(missed):
    """One cause for each missed cell, taking turns; none for the last cell."""
    kinds = list(CauseKind)
    return tuple(
        Cause(cell, kinds[number % len(kinds)], proved=True, detail="made up")
        for number, cell in enumerate(sorted(missed)[:-1])
    )
