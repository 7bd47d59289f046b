"""What a COLLADA file (.dae) would become, counted before a library makes it.

pycollada unzips without a cap and makes every instance of an instance anew, so a file of 3 kB can
fill the memory. Here its XML is run through once, and nothing is kept of it but counts.
"""

from __future__ import annotations

import io
import zipfile
from collections import defaultdict
from dataclasses import dataclass, field
from xml.parsers import expat

from coverable.meshes.raw_mesh import MeshError

MOST_CORNERS = 3_000_000  # of triangles, each instance counted
MOST_PARTS = 10_000  # primitives, each instance counted
MOST_ELEMENTS = 300_000  # polygons may be an element each
MOST_REFERENCES = 200  # nodes by reference; the file is searched anew for each
DEEPEST = 64  # elements, and instances, inside each other
_PRIMITIVES = ("triangles", "polylist", "polygons", "trifans", "tristrips")
_MESH = ["library_geometries", "geometry", "mesh"]  # what they lie in, below the root


@dataclass(slots=True)
class _Count:
    """Primitives, and corners of their triangles."""

    parts: int = 0
    corners: int = 0

    def add(self, other: _Count) -> None:
        """Count these too; refuse too many."""
        self.parts += other.parts
        self.corners += other.corners
        for count, most, what in (
            (self.parts, MOST_PARTS, "parts"),
            (self.corners, MOST_CORNERS, "corners of triangles"),
        ):
            if count > most:
                raise MeshError(
                    f"has more than {most:,} {what} with each instance counted; thin the mesh"
                )


@dataclass(slots=True)
class _Node:
    """What one <node> shows."""

    shapes: list[str] = field(default_factory=list)
    """Names of geometries."""
    nodes: list[int] = field(default_factory=list)
    """Nodes inside, by number."""
    references: list[str] = field(default_factory=list)
    """Names of nodes that are shown here too."""


def check_collada(data: bytes) -> None:
    """Refuse a file that is no plain XML, or whose instances are too many.

    Raises:
        MeshError: what it is instead, or of what there is too much.
    """
    if zipfile.is_zipfile(io.BytesIO(data)):
        raise MeshError("is a zip archive; unpack it first")
    scan = _Scan()
    try:
        scan.parser.Parse(data, True)
    except MeshError:  # a ValueError too
        raise
    except (expat.ExpatError, LookupError, ValueError) as error:  # the last: of an encoding
        raise MeshError(f"is broken XML: {error}") from error
    scan.count_instances()


@dataclass(slots=True)
class _Primitive:
    """What one <triangles>, <polylist> or the like holds."""

    tag: str
    indices: int = 0
    """Numbers that stand in its <p>, or a few more."""
    sizes: list[str] = field(default_factory=list)
    """Corners of its polygons, as text."""
    inputs: list[tuple[str, str, str]] = field(default_factory=list)
    """Meaning, source and offset of what each corner refers to."""

    def counted(self, vertices: set[str]) -> _Count:
        """Its corners, at most.

        Args:
            vertices: names of <vertices>; pycollada passes over other inputs that name one.

        Raises:
            MeshError: its polygons have more corners than are listed.
        """
        words = "".join(self.sizes).split()
        if any(not word.isdecimal() or len(word) > 9 for word in words) or (
            sum(map(int, words)) > self.indices
        ):
            raise MeshError("has polygons of more corners than are listed; it is damaged")
        offsets = [
            int(offset[:6])
            for meaning, source, offset in self.inputs
            if offset.isdecimal() and (meaning == "VERTEX" or source[1:] not in vertices)
        ]
        corners = self.indices // (1 + max(offsets, default=0))
        # A polygon becomes a fan of triangles.
        return _Count(1, corners if self.tag == "triangles" else 3 * corners)


class _Scan:
    """Runs through the XML and keeps counts."""

    def __init__(self) -> None:
        self.parser = expat.ParserCreate(namespace_separator="}")
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.CharacterDataHandler = self.text
        self.parser.StartDoctypeDeclHandler = self.doctype
        self.parser.buffer_text = True
        self.elements = 0
        self.references = 0
        self.open: list[str] = []
        self.geometry = ""  # the one that is open, or was last
        self.primitives: dict[str, list[_Primitive]] = defaultdict(list)  # of each geometry
        self.vertices: set[str] = set()
        self.nodes = [_Node()]  # number 0 holds those of the scenes
        self.named: dict[str, list[int]] = defaultdict(list)
        self.inside = [0]  # nodes that are open
        self.shapes: dict[str, _Count] = {}
        self.known: dict[int, _Count | None] = {}

    def doctype(self, *_: object) -> None:
        raise MeshError("holds a DOCTYPE, which can grow without bound; delete it")

    def start(self, name: str, attributes: dict[str, str]) -> None:
        tag = name.rpartition("}")[2]
        self.open.append(tag)
        self.elements += 1
        if self.elements > MOST_ELEMENTS:
            raise MeshError(f"has more than {MOST_ELEMENTS:,} XML elements; export triangles")
        if len(self.open) > DEEPEST:
            raise MeshError(f"has elements more than {DEEPEST} deep inside each other")
        target = attributes.get("url", "").removeprefix("#")
        if tag == "geometry" and self.open[1:] == _MESH[:2]:
            self.geometry = attributes.get("id", "")
        elif tag == "vertices":
            self.vertices.add(attributes.get("id", ""))
        elif tag in _PRIMITIVES and self.open[1:-1] == _MESH:
            self.primitives[self.geometry].append(_Primitive(tag))
        elif tag == "input" and self.in_primitive():
            keys = "semantic", "source", "offset"
            meaning, source, offset = (attributes.get(key, "") for key in keys)
            self.primitives[self.geometry][-1].inputs.append((meaning, source, offset))
        elif tag == "node":
            self._start_node(attributes.get("id", ""))
        elif tag == "instance_geometry":
            self.nodes[self.inside[-1]].shapes.append(target)
        elif tag == "instance_node":
            self.references += 1
            if self.references > MOST_REFERENCES:
                raise MeshError(f"refers to nodes more than {MOST_REFERENCES} times")
            self.nodes[self.inside[-1]].references.append(target)

    def in_primitive(self) -> bool:
        """Is the element that is open one of a primitive?"""
        return self.open[1:4] == _MESH and len(self.open) == 6 and self.open[4] in _PRIMITIVES

    def _start_node(self, name: str) -> None:
        number = len(self.nodes)
        self.nodes.append(_Node())
        # What lies in a library is shown where it is named; the rest in the scene itself.
        if len(self.inside) > 1 or "library_nodes" not in self.open:
            self.nodes[self.inside[-1]].nodes.append(number)
        self.named[name].append(number)
        self.inside.append(number)

    def end(self, _: str) -> None:
        tag = self.open.pop()
        if tag == "node":
            self.inside.pop()

    def text(self, text: str) -> None:
        if self.in_primitive() and self.open[-1] in ("p", "vcount"):
            primitive = self.primitives[self.geometry][-1]
            if self.open[-1] == "p":
                primitive.indices += len(text.split()) + 1
            else:
                primitive.sizes.append(text)

    def count_instances(self) -> None:
        """Count all that the scenes show.

        Raises:
            MeshError: too much, or nodes that show themselves.
        """
        for name, primitives in self.primitives.items():
            self.shapes[name] = count = _Count()
            for primitive in primitives:
                count.add(primitive.counted(self.vertices))
        self._count(0, 0)

    def _count(self, number: int, depth: int) -> _Count:
        """What a node shows."""
        if number in self.known:
            found = self.known[number]
            if found is None:
                raise MeshError("has a node that contains itself")
            return found
        if depth > DEEPEST:
            raise MeshError(f"has nodes more than {DEEPEST} deep inside each other")
        self.known[number] = None
        node, total = self.nodes[number], _Count(1)
        for shape in node.shapes:
            total.add(self.shapes.get(shape, _Count()))
        shown = [n for name in node.references for n in self.named[name]]
        for inner in (*node.nodes, *shown):
            total.add(self._count(inner, depth + 1))
        self.known[number] = total
        return total
