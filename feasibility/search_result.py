"""What a search hands over: what it found and counted, before any of it is certified."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.faults import Replay
from feasibility.verdict import Cause, Walk

if TYPE_CHECKING:
    import networkx as nx

    from feasibility.cut_tree import CutTree


@dataclass(frozen=True, eq=False, kw_only=True)
class SearchResult:
    """The end of a search, of either method."""

    covered: Mask
    """(N,) cells that the best single component covers."""
    components: tuple[Ints, ...]
    """Cells of each connected component found, the best first."""
    postures: Array | None = None
    """(K, n) a configuration of each of `components`; None where none is kept."""
    start: int | None
    """Flat index of the cell where the best motion starts."""
    n_edges: int
    """Number of edges of graph G."""
    counts: Mapping[str, Any]
    """Work done: FK evaluations (`fk`), nodes, calls, boxes."""
    motion: Walk | None = None
    """One motion over the centres of all cells, where there is one."""
    hindered: bool = False
    """Did convex bodies of the arm keep the search from going anywhere?"""
    replay: Callable[[], Replay] | None = None
    """Replays the motion over all cells by Pinocchio; None where none was found."""
    accepted: str = ""
    """The message when the replay accepts; {waypoints} is replaced by their number."""
    refused: str = ""
    """The message when it refuses; {refusal} is replaced by its reason."""
    proof: CutTree | None = None
    """Why no motion covers all cells; None where that is not proved."""
    proved: str = ""
    """The message about the proof."""
    unfinished: str = ""
    """What was left untried, a time limit that ran out, say; empty where nothing was."""
    exhausted: str = ""
    """What was tried in vain."""
    make_graph: Callable[[], nx.Graph]
    """Makes graph G, see `Verdict.graph`."""
    make_causes: Callable[[], tuple[Cause, ...]]
    """Finds the cause of each missed cell, see `Verdict.causes`."""
    make_tree: Callable[[], nx.DiGraph | None] = field(default=lambda: None)
    """Makes tree T, see `Verdict.tree`."""
