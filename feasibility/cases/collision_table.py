"""The [collision] table of a case: what the arm has to stay clear of, and by how much."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, NamedTuple, cast

from coverable.errors import MISSING, CoverableError, Fault, is_number
from feasibility.cases.table_reader import CaseError, Section, frozen, is_text
from feasibility.collisions.scene import SHAPES, Obstacle, ToolShape, checked_distance
from feasibility.collisions.settings import Collision, checked_pair
from feasibility.collisions.shapes import read_triangles
from feasibility.collisions.words import asked_for

MAKERS = {"scene": Obstacle, "tool": ToolShape}
KINDS = {"scene": tuple(SHAPES), "tool": tuple(kind for kind in SHAPES if kind != "halfspace")}
COMMON = {
    "scene": ("name", "position", "rpy_deg", "clearance", "frame"),
    "tool": ("position", "rpy_deg"),
}
"""Keys of every object."""
NAMES = {"self_": "self"}
"""Keys of arguments that are called otherwise in Python."""


@dataclass(frozen=True, slots=True)
class CollisionPart:
    """The [collision] table of a case; its fields are those of `Collision`, paths absolute."""

    self_: bool = True
    surface: bool = True
    clearance: float = 0.0
    tool_clearance: float = 0.0
    tool_links: tuple[str, ...] = ()
    allow: tuple[tuple[str, str], ...] = ()
    clearances: tuple[tuple[str, str, float], ...] = ()
    srdf: str | None = None
    shapes: str = "hulls"
    thickness: float = 0.0
    scene: tuple[Mapping[str, Any], ...] = ()
    """As they are written, paths absolute; those of `tool`, too."""
    tool: tuple[Mapping[str, Any], ...] = ()

    @property
    def checked(self) -> tuple[str, ...]:
        """As `Collision.checked`."""
        return asked_for(self.self_, self.surface, bool(self.scene))

    def table(self) -> dict[str, Any]:
        """The keys of the [collision] table that say something."""
        values = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        values["clearances"] = tuple(
            {"pair": (first, second), "value": value} for first, second, value in self.clearances
        )
        for key in MAKERS:
            values[key] = tuple(map(dict, values[key]))
        return {
            NAMES.get(key, key): value for key, value in values.items() if value not in (None, ())
        }

    def build(self) -> Collision:
        """Make the objects; their meshes are read.

        Raises:
            CaseError: a mesh cannot be used; the faults of all are named.
        """
        faults: list[Fault] = []
        values: dict[str, Any] = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        for key, make in MAKERS.items():
            made = []
            for k, part in enumerate(values[key]):
                try:
                    own = {name: value for name, value in part.items() if name != "kind"}
                    made.append(getattr(make, part["kind"])(**own))
                except CoverableError as error:
                    place = f"collision.{key}[{k}]"
                    faults += [fault.renamed({}, place) for fault in error.faults]
            values[key] = made
        if faults:
            raise CaseError(faults)
        return Collision(**values)


class _Entry(NamedTuple):
    """One object, as it is written and as it is checked."""

    part: Mapping[str, Any]
    stand_in: Obstacle | ToolShape
    """The object; where it is a mesh, another in its place."""


def read_collision(table: Any, faults: list[Fault]) -> CollisionPart | None:
    """Read the [collision] table; None where it has faults.

    Meshes are read by `CollisionPart.build` only.
    """
    before = len(faults)
    section = Section("collision", table, faults)
    plain = {entry.name for entry in fields(CollisionPart)} - {"srdf", "clearances", *MAKERS}
    values: dict[str, Any] = section.take(*sorted(plain))
    if section.has("self"):
        values["self_"] = section.table["self"]
    values |= section.path("srdf")
    if section.has("clearances"):
        values["clearances"] = _clearances(section)
    objects = {key: _objects(section, key) for key in MAKERS}
    section.refuse_others()
    stand_ins = {key: [entry.stand_in for entry in found] for key, found in objects.items()}
    section.make(Collision, {**values, **stand_ins}, NAMES)
    if len(faults) > before:
        return None
    for key, found in objects.items():
        values[key] = tuple(entry.part for entry in found)
    return CollisionPart(**frozen(values))


def faults_of_meshes(table: Any) -> list[Fault]:
    """What is wrong with the mesh files that a table names, whatever else is wrong with it."""
    faults = []
    for key, k, entry in _meshes(table):
        scale = entry.get("scale", 1.0)  # the likely size is nothing to go by beside other faults
        known = is_number(scale) and 1e-9 <= scale <= 1e9
        try:
            read_triangles(entry["file"], scale if known else 1.0)
        except CoverableError as error:
            faults += [fault.renamed({}, f"collision.{key}[{k}]") for fault in error.faults]
    return faults


def _meshes(table: Any) -> Iterator[tuple[str, int, Mapping[str, Any]]]:
    """The entries of a table that name a mesh file: where, and which."""
    for key in MAKERS if isinstance(table, Mapping) else ():
        entries = table.get(key)
        for k, entry in enumerate(entries if isinstance(entries, list) else ()):
            named = isinstance(entry, Mapping) and is_text(entry.get("file"))
            if named and entry.get("kind") == "mesh":
                yield key, k, entry


def _clearances(section: Section) -> list[tuple[str, str, float]]:
    """The rows of `clearances` without faults."""
    rows, found = section.table["clearances"], []
    if not isinstance(rows, list):
        section.wrong_type("clearances", rows)
        return []
    for k, row in enumerate(rows):
        entry = Section(f"collision.clearances[{k}]", row, section.faults)
        if entry.is_table:
            values = {"pair": MISSING, "value": MISSING} | entry.take("pair", "value")
            pair = checked_pair(entry, "pair", values["pair"])
            distance = checked_distance(entry, "value", values["value"])
            entry.refuse_others()
            found += [] if pair is None else [(*pair, distance)]
    return found


def _objects(section: Section, key: str) -> list[_Entry]:
    """The objects of `scene` or `tool` that have no faults."""
    entries = section.take(key).get(key, [])
    if not isinstance(entries, list):
        section.wrong_type(key, entries)
        return []
    found = [_object(section, key, k, entry) for k, entry in enumerate(entries)]
    return [entry for entry in found if entry is not None]


def _object(section: Section, key: str, k: int, entry: Any) -> _Entry | None:
    """One object; None where it has faults."""
    from surfaces.meshes.sources import metres_per_unit

    before = len(section.faults)
    found = Section(f"collision.{key}[{k}]", entry, section.faults)
    kind = found.word("kind", KINDS[key], required=True)
    if kind is None:  # which other keys belong here is not known
        return None
    own, make = SHAPES[kind], MAKERS[key]
    values = found.take(*own, *COMMON[key])
    if kind == "mesh":
        values |= found.path(required=True)
        if "scale" in values:
            found.make(metres_per_unit, {"scale": values["scale"]})
    others = {other for keys in SHAPES.values() for other in keys} - set(own)
    says = f"is no key of a {kind}; it has {', '.join((*own, *COMMON[key]))}"
    found.refuse_others(dict.fromkeys(sorted(others), says))
    pose = {name: values[name] for name in COMMON[key] if name in values}
    if key == "scene":
        pose = {"name": MISSING} | pose
    if kind == "mesh":
        make_it = Obstacle.halfspace if key == "scene" else lambda **at: ToolShape.sphere(1.0, **at)
        stand_in = found.make(make_it, pose)
    else:
        needed = dict.fromkeys(own, MISSING)
        stand_in = found.make(getattr(make, kind), needed | values | pose)
    if stand_in is None or len(section.faults) > before:
        return None
    return _Entry({"kind": kind, **frozen(values)}, cast("Obstacle | ToolShape", stand_in))
