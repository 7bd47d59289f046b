"""The table [collision]: what has to stay clear of what, and by how much."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, get_args

from coverable.errors import Checks, Fault, close, shown
from feasibility.collisions.scene import Obstacle, ToolShape, checked_distance
from feasibility.collisions.words import SURFACE, TOOL, asked_for
from robots.shapes.bodies import Fineness

MOST_OBJECTS = 1000


@dataclass(frozen=True, eq=False, slots=True)
class Collision:
    """What the arm has to stay clear of: `Task(..., collision=Collision(clearance=0.005))`.

    Raises:
        ArgumentError: a number is no clearance, two objects have one name, or pairs contradict each
            other; all that is wrong is named. Whether the links exist is judged with the arm, see
            `unknown_names`.

    Example:
        >>> from coverable import Obstacle
        >>> shelf = Obstacle.box("shelf", (0.5, 0.6, 0.02), position=(0.55, 0.0, 0.5))
        >>> Collision(clearance=0.005, scene=(shelf,)).checked
        ('self', 'surface', 'scene')
        >>> Collision(clearance=-1.0, shapes="x")
        Traceback (most recent call last):
        coverable.errors.ArgumentError: collision: 2 faults:
          clearance must be a number in 0 .. 10 (metres), got -1.0
          shapes must be 'hulls', 'pieces' or 'meshes', got 'x'
    """

    self_: bool = True
    """Links against each other."""
    surface: bool = True
    """The arm against the surface itself, a two-sided sheet."""
    clearance: float = 0.0
    """m, every pair."""
    tool_clearance: float = 0.0
    """m, the tool against the surface."""
    tool_links: tuple[str, ...] = ()
    """Links that are the tool; where none are named, the shapes that move with the last joint."""
    allow: tuple[tuple[str, str], ...] = ()
    """Pairs that are not checked: links, objects of the scene, 'surface' or 'tool'."""
    clearances: tuple[tuple[str, str, float], ...] = field(default=())
    """Pairs with a clearance of their own, m."""
    srdf: str | None = None
    """Path of an SRDF whose pairs are left out."""
    shapes: Fineness = "hulls"
    """What the search takes for a link: one hull a shape, convex pieces of it, or pieces with the
    judge's word on the meshes themselves."""
    thickness: float = 0.0
    """m, of the sheet, away from the working side."""
    scene: tuple[Obstacle, ...] = ()
    tool: tuple[ToolShape, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what cannot be asked; keep plain numbers, and tuples."""
        checks = Checks("collision")
        kept: dict[str, Any] = {
            name: checked_distance(checks, name, getattr(self, name))
            for name in ("clearance", "tool_clearance", "thickness")
        }
        for name in ("self_", "surface"):
            if not isinstance(getattr(self, name), bool):
                checks.wrong(name, getattr(self, name), "must be true or false")
        kept["shapes"] = checks.choice("shapes", self.shapes, get_args(Fineness))
        kept["tool_links"] = _names_of(checks, "tool_links", self.tool_links)
        kept["allow"] = _pairs_of(checks, "allow", self.allow)
        kept["clearances"] = _clearances_of(checks, self.clearances)
        kept |= _objects(checks, self.scene, self.tool)
        if self.srdf is not None and not (isinstance(self.srdf, str) and self.srdf.strip()):
            checks.wrong("srdf", self.srdf, "must be the path of an SRDF file, or None")
        allowed = {frozenset(pair) for pair in kept["allow"]}
        for k, (first, second, _) in enumerate(kept["clearances"]):
            if frozenset((first, second)) in allowed:
                pair = f"{first!r} and {second!r} are also in allow; leave one of the two out"
                checks.keep(Fault(f"clearances[{k}]", pair))
        checks.done()
        for name, value in kept.items():
            object.__setattr__(self, name, value)

    @property
    def checked(self) -> tuple[str, ...]:
        """What is checked: some of 'self', 'surface' and 'scene'."""
        return asked_for(self.self_, self.surface, bool(self.scene))

    @property
    def without_surface(self) -> Collision:
        """The same where there is no surface, only poses, nor any pair with it."""
        return replace(
            self,
            surface=False,
            allow=tuple(pair for pair in self.allow if SURFACE not in pair),
            clearances=tuple(row for row in self.clearances if SURFACE not in row[:2]),
        )

    def raised(self, more: float) -> Collision:
        """The same with clearances larger by `more` (m), but for the tool over the surface."""
        rows = tuple((first, second, value + more) for first, second, value in self.clearances)
        scene = tuple(
            one if one.clearance is None else replace(one, clearance=one.clearance + more)
            for one in self.scene
        )
        return replace(self, clearance=self.clearance + more, clearances=rows, scene=scene)

    def unknown_names(self, links: Sequence[str]) -> list[Fault]:
        """Faults of names that are neither links of the arm nor objects, to be raised later."""
        objects = [obstacle.name for obstacle in self.scene]
        known = [*links, *objects, *([SURFACE] if self.surface else []), TOOL]
        faults = [
            Fault(f"scene[{k}].name", f"{name!r} is also a link of the arm; choose another")
            for k, name in enumerate(objects)
            if name in links
        ]
        named = [(f"tool_links[{k}]", name) for k, name in enumerate(self.tool_links)]
        named += [(f"scene[{k}].frame", one.frame) for k, one in enumerate(self.scene) if one.frame]
        for key, name in named:
            faults += _stranger(key, name, links, "a link of the arm")
        pairs = [(f"allow[{k}]", pair) for k, pair in enumerate(self.allow)]
        pairs += [(f"clearances[{k}].pair", row[:2]) for k, row in enumerate(self.clearances)]
        what = "a link, an object of the scene, 'surface' or 'tool'"
        for key, name in ((key, name) for key, pair in pairs for name in pair):
            if name == SURFACE and not self.surface:
                text = "names the surface, which is not checked; write surface = true"
                faults.append(Fault(key, text))
            else:
                faults += _stranger(key, name, known, what)
        return faults


def _objects(checks: Checks, scene: Any, tool: Any) -> dict[str, tuple[Any, ...]]:
    """The objects of the scene, each with a name of its own, and the shapes of the tool."""
    kept: dict[str, tuple[Any, ...]] = {}
    for key, given, kind in (("scene", scene, Obstacle), ("tool", tool, ToolShape)):
        expected = f"must be a list of {kind.__name__}, such as {kind.__name__}.box makes"
        rows = _sequence(checks, key, given, expected)
        if len(rows) > MOST_OBJECTS:
            got = f"has {len(rows):,} objects, more than {MOST_OBJECTS:,}: join them as a mesh"
            checks.keep(Fault(key, got))
        for k, row in enumerate(rows):
            if not isinstance(row, kind):
                checks.wrong(f"{key}[{k}]", row, f"must be made by {kind.__name__}")
        kept[key] = tuple(row for row in rows if isinstance(row, kind))
    _refuse_repeated(checks, "scene", [obstacle.name for obstacle in kept["scene"]])
    return kept


def _stranger(key: str, name: str, known: Sequence[str], what: str) -> list[Fault]:
    """The fault of a name that is not known, if it is not."""
    if name in known:
        return []
    guess = close(name, known)
    hint = f"did you mean {guess}?" if guess else f"there are {', '.join(known[:20])}"
    return [Fault(key, f"got {shown(name)}; {hint}", expected=f"must be {what}")]


def _sequence(checks: Checks, key: str, value: Any, expected: str) -> Sequence[Any]:
    """A list or tuple; empty after a fault."""
    if isinstance(value, (list, tuple)):
        return value
    checks.wrong(key, value, expected)
    return ()


def _names_of(checks: Checks, key: str, value: Any) -> tuple[str, ...]:
    """Names, each once."""
    expected = 'must be a list of names of links, such as ["nozzle"]'
    names = _sequence(checks, key, value, expected)
    if not all(isinstance(name, str) and name for name in names):
        checks.wrong(key, value, expected)
        return ()
    _refuse_repeated(checks, key, names)
    return tuple(names)


def checked_pair(checks: Checks, key: str, value: Any) -> tuple[str, str] | None:
    """Two different names."""
    expected = 'must be two different names, such as ["link5", "link7"]'
    if isinstance(value, (list, tuple)) and len(value) == 2:
        first, second = value
        if all(isinstance(name, str) and name for name in value) and first != second:
            return first, second
    checks.wrong(key, value, expected)
    return None


def _pairs_of(checks: Checks, key: str, value: Any) -> tuple[tuple[str, str], ...]:
    """Pairs of names; the same twice does no harm."""
    expected = 'must be a list of pairs of names, such as [["link5", "link7"]]'
    rows = _sequence(checks, key, value, expected)
    found = [checked_pair(checks, f"{key}[{k}]", row) for k, row in enumerate(rows)]
    return tuple(pair for pair in found if pair is not None)


def _clearances_of(checks: Checks, value: Any) -> tuple[tuple[str, str, float], ...]:
    """Pairs with a distance each, no pair twice."""
    key, found = "clearances", []
    expected = "must be a list of (name, name, metres)"
    for k, row in enumerate(_sequence(checks, key, value, expected)):
        if not isinstance(row, (list, tuple)) or len(row) != 3:
            checks.wrong(f"{key}[{k}]", row, "must be (name, name, metres)")
            continue
        pair = checked_pair(checks, f"{key}[{k}].pair", row[:2])
        distance = checked_distance(checks, f"{key}[{k}].value", row[2])
        if pair is not None:
            found.append((*pair, distance))
    _refuse_repeated(checks, key, [" and ".join(sorted(row[:2])) for row in found])
    return tuple(found)


def _refuse_repeated(checks: Checks, key: str, names: Iterable[str]) -> None:
    """Keep a fault of each name that is there more than once."""
    for name, count in Counter(names).items():
        if count > 1:
            checks.keep(Fault(key, f"has {shown(name)} {count} times; one of them is enough"))
