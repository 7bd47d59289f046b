"""The process that reads one STEP file; started by `step_process`, never imported by it.

Open CASCADE is native code that was not written for files from elsewhere. So it runs without
environment, with caps on memory and processor time, and from the moment it sees the file on
without a free file descriptor: whatever the file names, nothing can be opened.

The standard input holds the job as a line of JSON, and then the file. What leaves is a line of
JSON too, and after it the bytes of the arrays it describes: (V, 3) float64 m, (F, 3) int32.
"""

from __future__ import annotations

import importlib
import io
import itertools
import json
import math
import os
import resource
import sys
from collections.abc import Iterator
from typing import Any

MILLIMETRE = 1e-3  # m; Open CASCADE turns all units into millimetres
# Of edges and inner points of a triangle, as weights of its corners: where it may lie off the face.
WITHIN = ((0.5, 0.5, 0.0), (0.0, 0.5, 0.5), (0.5, 0.0, 0.5), (1 / 3, 1 / 3, 1 / 3))
MODULES = (  # of Open CASCADE
    "BRep", "BRepAdaptor", "BRepGProp", "BRepMesh", "BRepTools", "collections", "GeomAdaptor",
    "GeomAPI", "gp", "GProp", "IFSelect", "IntTools", "Quantity", "Standard", "STEPCAFControl",
    "TCollection", "TDocStd", "TopAbs", "TopExp", "TopLoc", "TopoDS", "XCAFDoc",
)  # fmt: skip
LATTICE = (4, 16)  # places of a face along u and along v among which its middle one is found
VIEWED = (0.55, -0.70, 0.45)  # from a part to a viewer, about
MOST_PROJECTED, LAST_QUICK = 20_000, 4  # points put onto faces at 1 ms; up to tori it is quick


class Refused(Exception):
    """What is wrong with the file or with the question."""


class Part:
    """The faces of a STEP file, numbered from 1 as Open CASCADE explores them."""

    def __init__(self, data: bytes) -> None:
        """Read a file.

        Raises:
            Refused: it cannot be read, or holds no face.
        """
        from OCP.IFSelect import IFSelect_ReturnStatus
        from OCP.STEPCAFControl import STEPCAFControl_Reader
        from OCP.TCollection import TCollection_ExtendedString
        from OCP.TDocStd import TDocStd_Document
        from OCP.XCAFDoc import XCAFDoc_DocumentTool

        document = TDocStd_Document(TCollection_ExtendedString("XCAF"))
        reader = STEPCAFControl_Reader()
        reader.SetColorMode(True)
        status = reader.ReadStream("part.step", io.BytesIO(data))
        if status != IFSelect_ReturnStatus.IFSelect_RetDone:
            raise Refused("is no STEP file that can be read: it is damaged; export it again")
        if not reader.Transfer(document):
            raise Refused("holds no shape that can be read; export the part's surfaces as STEP")
        self.shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
        self.colours = XCAFDoc_DocumentTool.ColorTool_s(document.Main())
        self.document = document
        whole = self.shapes.GetOneShape()
        self.faces = [] if whole is None or whole.IsNull() else list(faces_of(whole))
        if not self.faces:
            raise Refused("holds no face; export the part's surfaces or its solid as STEP")

    def colour_of_each(self) -> list[str]:
        """The colour of each face as "#rrggbb"; empty where it has none.

        That of the face itself, else of the body it belongs to, else of the part.
        """
        from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as Map
        from OCP.collections import Sequence_TDF_Label
        from OCP.Quantity import Quantity_Color
        from OCP.XCAFDoc import XCAFDoc_ColorTool, XCAFDoc_ColorType, XCAFDoc_ShapeTool

        kinds = XCAFDoc_ColorType.XCAFDoc_ColorGen, XCAFDoc_ColorType.XCAFDoc_ColorSurf
        coloured = []
        parts = Sequence_TDF_Label()
        self.shapes.GetShapes(parts)
        for part in parts:
            inner = Sequence_TDF_Label()
            XCAFDoc_ShapeTool.GetSubShapes_s(part, inner)
            for label in (part, *inner):
                for kind in kinds:
                    colour = Quantity_Color()
                    if XCAFDoc_ColorTool.GetColor_s(label, kind, colour):
                        shape = XCAFDoc_ShapeTool.GetShape_s(label)
                        named = Quantity_Color.ColorToHex_s(colour, True).ToCString().lower()
                        coloured.append((shape.ShapeType().value, named, shape))
        # Larger shapes come first (a compound is type 0, a face 4), so that smaller ones win.
        coloured.sort(key=lambda one: one[0])
        known = Map()
        names: dict[int, str] = {}
        for _, named, shape in coloured:
            names |= {known.Add(unplaced(face)): named for face in faces_of(shape)}
        return [names.get(known.FindIndex(unplaced(face)), "") for face in self.faces]

    def described(self) -> list[dict[str, Any]]:
        """Each face's kind, area (m^2), colour, and a place on it (m) with its outward normal."""
        from OCP.BRepAdaptor import BRepAdaptor_Surface
        from OCP.BRepGProp import BRepGProp
        from OCP.GProp import GProp_GProps
        from OCP.Standard import Standard_Failure

        found = []
        for face, colour in zip(self.faces, self.colour_of_each(), strict=True):
            properties = GProp_GProps()
            BRepGProp.SurfaceProperties_s(face, properties)
            kind = BRepAdaptor_Surface(face, False).GetType().name.removeprefix("GeomAbs_")
            try:
                centre, normal = middle_of(face, properties.CentreOfMass().Coord())
            except Standard_Failure:
                centre = normal = [0.0] * 3
            own = {"area": properties.Mass() * MILLIMETRE**2, "centre": centre, "normal": normal}
            found.append({"kind": kind.lower(), "colour": colour, **own})
        return found

    def triangulated(self, numbers: list[int], deviation: float, angle: float) -> Triangles:
        """Cut some faces into triangles.

        Args:
            numbers: of the faces.
            deviation: m, wanted.
            angle: rad, between neighbouring triangles on a curved face, about.

        Raises:
            Refused: a face cannot be cut.
        """
        from OCP.BRep import BRep_Builder
        from OCP.BRepMesh import BRepMesh_IncrementalMesh
        from OCP.TopoDS import TopoDS_Compound

        chosen, builder = TopoDS_Compound(), BRep_Builder()
        builder.MakeCompound(chosen)
        for number in numbers:
            builder.Add(chosen, self.faces[number - 1])
        # Of one shape, so that faces get the same points on the edges that they share.
        BRepMesh_IncrementalMesh(chosen, deviation / MILLIMETRE, False, angle, False)
        made = Triangles()
        for number in numbers:
            made.add(self.faces[number - 1], number)
        return made


class Triangles:
    """Triangles of faces, and how far they lie off them."""

    def __init__(self) -> None:
        """Start with none."""
        self.vertices: list[tuple[float, float, float]] = []
        self.corners: list[tuple[int, int, int]] = []
        self.counts: list[int] = []
        """How many triangles each face has."""
        self.deviation = 0.0
        """m, the largest at the middles of triangles and edges, or a little more."""
        self.left = MOST_PROJECTED

    def add(self, face: Any, number: int) -> None:
        """Add those of a face, their outer side that of the body.

        Raises:
            Refused: it has none.
        """
        from OCP.BRep import BRep_Tool
        from OCP.TopAbs import TopAbs_Orientation
        from OCP.TopLoc import TopLoc_Location

        place = TopLoc_Location()
        cut = BRep_Tool.Triangulation_s(face, place)
        if cut is None or not cut.NbTriangles():
            raise Refused(
                f"has a face, {number}, that cannot be cut into triangles; leave it out, or mend "
                "it where the file comes from"
            )
        move, first = place.Transformation(), len(self.vertices)
        nodes = [cut.Node(k + 1) for k in range(cut.NbNodes())]
        triangles = [cut.Triangle(k + 1) for k in range(cut.NbTriangles())]
        corners = [tuple(one.Value(k) - 1 for k in (1, 2, 3)) for one in triangles]
        self.counts.append(len(corners))
        self._measure(face, cut, nodes, corners)
        turned = face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED
        turned ^= move.IsNegative()
        for a, b, c in corners:
            ends = (a, c, b) if turned else (a, b, c)
            self.corners.append(tuple(first + end for end in ends))
        for node in nodes:
            x, y, z = (MILLIMETRE * value for value in node.Transformed(move).Coord())
            self.vertices.append((x, y, z))

    def _measure(self, face: Any, cut: Any, nodes: list[Any], corners: list[Any]) -> None:
        """Compare triangles with the face at the same parameters.

        At a pole that may be far off a triangle that is close to the face. So the points furthest
        off are projected onto the face, until no other can be further off.
        """
        from OCP.BRep import BRep_Tool
        from OCP.BRepTools import BRepTools
        from OCP.GeomAdaptor import GeomAdaptor_Surface
        from OCP.GeomAPI import GeomAPI_ProjectPointOnSurf
        from OCP.gp import gp_Pnt
        from OCP.TopLoc import TopLoc_Location

        if not cut.HasUVNodes():
            raise Refused("has a face without parameters, which cannot be measured; leave it out")
        whole = BRep_Tool.Surface_s(face, TopLoc_Location())
        surface = GeomAdaptor_Surface(whole)
        places = [node.Coord() for node in nodes]
        values = [cut.UVNode(k + 1).Coord() for k in range(len(nodes))]
        most, further = self.deviation / MILLIMETRE, list[tuple[float, list[float]]]()
        for ends in corners:
            for weights in WITHIN:
                u, v = mean([values[k] for k in ends], weights)
                flat = mean([places[k] for k in ends], weights)
                off = math.dist(flat, surface.Value(u, v).Coord())
                if off > most:
                    further.append((off, flat))
        foot = GeomAPI_ProjectPointOnSurf()
        foot.Init(whole, *BRepTools.UVBounds_s(face))
        for off, flat in sorted(further, reverse=True):
            if off <= most:
                break
            if self.left > 0:
                self.left -= surface.GetType().value > LAST_QUICK
                foot.Perform(gp_Pnt(*flat))
                off = min(off, foot.LowerDistance()) if foot.NbPoints() else off
            most = max(most, off)
        self.deviation = MILLIMETRE * most


def mean(values: list[tuple[float, ...]], weights: tuple[float, ...]) -> list[float]:
    """Of some vectors, weighted."""
    rows = zip(*values, strict=True)
    return [sum(w * x for w, x in zip(weights, row, strict=True)) for row in rows]


def faces_of(shape: Any) -> Iterator[Any]:
    """The faces of a shape, each once, in the order in which they are explored."""
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as Map
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp
    from OCP.TopoDS import TopoDS

    found = Map()
    TopExp.MapShapes_s(shape, TopAbs_ShapeEnum.TopAbs_FACE, found)
    for k in range(found.Size()):
        yield TopoDS.Face(found.FindKey(k + 1))


def middle_of(face: Any, centre: tuple[float, ...]) -> tuple[list[float], list[float]]:
    """The place (m) of a face, off its border, that is nearest to its centre, and its normal.

    The centre itself may lie in a hole, or off the face, as that of a sphere: of places that are
    equally near, one is taken that a viewer sees. The normal is zero where none is found.
    """
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepTools import BRepTools
    from OCP.gp import gp_Pnt, gp_Pnt2d, gp_Vec
    from OCP.IntTools import IntTools_FClass2d
    from OCP.TopAbs import TopAbs_Orientation, TopAbs_State

    surface, inside = BRepAdaptor_Surface(face, False), IntTools_FClass2d(face, 1e-7)
    turned = face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED
    turned ^= face.Location().Transformation().IsNegative()
    u0, u1, v0, v1 = BRepTools.UVBounds_s(face)
    found = []
    for count in LATTICE:
        shares = [k / count for k in range(1, count)]
        for a, b in itertools.product(shares, shares):
            u, v = u0 + a * (u1 - u0), v0 + b * (v1 - v0)
            if inside.Perform(gp_Pnt2d(u, v)) != TopAbs_State.TopAbs_IN:
                continue
            place, along_u, along_v = gp_Pnt(), gp_Vec(), gp_Vec()
            surface.D1(u, v, place, along_u, along_v)
            across = along_u.Crossed(along_v)
            size = (-1.0 if turned else 1.0) * across.Magnitude()
            normal = [part / size if size else 0.0 for part in across.Coord()]
            seen = sum(a * b for a, b in zip(normal, VIEWED, strict=True))
            away = float(f"{math.dist(place.Coord(), centre):.6g}")
            found.append((away, -seen, place.Coord(), normal))
        if found:
            break
    _, _, middle, normal = min(found, default=(0.0, 0.0, centre, [0.0] * 3))
    return [MILLIMETRE * part for part in middle], normal


def unplaced(face: Any) -> Any:
    """The same for a face at any place of a part with it."""
    from OCP.TopLoc import TopLoc_Location

    return face.Located(TopLoc_Location())


def answer(job: dict[str, Any], data: bytes) -> bytes:
    """The faces of the file, and triangles of some.

    Raises:
        Refused: there is no such face, or nothing can be read.
    """
    import numpy as np

    part = Part(data)
    reply: dict[str, Any] = {"faces": part.described()}
    colours = [face["colour"] for face in reply["faces"]]
    numbers = job["numbers"]
    if job["colour"] or numbers == "all":
        wanted = {job["colour"]} if job["colour"] else set(colours)
        numbers = [k + 1 for k, colour in enumerate(colours) if colour in wanted]
    numbers = [number for number in dict.fromkeys(numbers) if number <= len(colours)]
    if not numbers:
        return json.dumps(reply).encode() + b"\n"
    made = part.triangulated(numbers, job["deviation"], job["angle"])
    vertices = np.array(made.vertices, dtype="<f8").reshape(-1, 3)
    corners = np.array(made.corners, dtype="<i4").reshape(-1, 3)
    reply |= {"taken": numbers, "deviation": made.deviation}
    reply |= {"vertices": len(vertices), "triangles": len(corners), "counts": made.counts}
    return json.dumps(reply).encode() + b"\n" + vertices.tobytes() + corners.tobytes()


def _load_all() -> None:
    """Import what reading takes, as long as files can be opened."""
    for name in ("numpy", *(f"OCP.{module}" for module in MODULES)):
        importlib.import_module(name)


def main() -> None:
    """Do the job on the standard input."""
    job = json.loads(sys.stdin.buffer.readline())
    data = sys.stdin.buffer.read()
    sys.path[:0] = job["library"]
    _load_all()
    written = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # Open CASCADE writes messages to the standard output
    resource.setrlimit(resource.RLIMIT_NOFILE, (0, 0))
    try:
        reply = answer(job, data)
    except (Refused, MemoryError) as error:
        reply = json.dumps({"fault": str(error) or "needs too much memory"}).encode() + b"\n"
    written.write(reply)
    written.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
