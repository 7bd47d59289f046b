"""Write a small part as STEP files with Open CASCADE: step_parts.py FOLDER X Y Z RADIUS (metres).

A script, so that the libraries of Open CASCADE are not loaded beside those of Pinocchio.
"""

import sys
from pathlib import Path
from typing import Any

from OCP.BRepFilletAPI import BRepFilletAPI_MakeFillet
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeSphere
from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf, gp_Vec
from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.Interface import Interface_Static
from OCP.Quantity import Quantity_Color, Quantity_TypeOfColor
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS
from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool

RED, GREY = (1.0, 0.0, 0.0), (0.5, 0.5, 0.5)


def write_part(
    path: Path, size: list[float], radius: float, unit: str = "MM", placed: bool = False
) -> None:
    """A box from the origin to `size`, its edge along z at the origin round and red, the rest grey.

    In metres, and in the file in `unit`. `placed` is an assembly of two of it, the second turned by
    90 degrees about z and 1 m up.
    """
    box = BRepPrimAPI_MakeBox(*(1e3 * length for length in size)).Shape()
    fillet = BRepFilletAPI_MakeFillet(box)
    fillet.Add(
        1e3 * radius, TopoDS.Edge(TopExp_Explorer(box, TopAbs_ShapeEnum.TopAbs_EDGE).Current())
    )
    shape = fillet.Shape()
    document = TDocStd_Document(TCollection_ExtendedString("XCAF"))
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    colours = XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    part = shapes.AddShape(shape, False)
    _paint(colours, part, GREY)
    _paint(colours, shapes.AddSubShape(part, _third_face(shape)), RED)
    if placed:
        move, turn = gp_Trsf(), gp_Trsf()
        turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 1.5707963267948966)
        move.SetTranslation(gp_Vec(0, 0, 1e3))
        both = shapes.NewShape()
        for place in (gp_Trsf(), move.Multiplied(turn)):
            shapes.AddComponent(both, part, TopLoc_Location(place))
        shapes.UpdateAssemblies()
    writer = STEPCAFControl_Writer()
    writer.SetColorMode(True)
    assert Interface_Static.SetCVal_s("write.step.unit", unit)
    assert writer.Transfer(document)
    assert writer.Write(str(path)) == IFSelect_ReturnStatus.IFSelect_RetDone


def _third_face(shape: Any) -> Any:
    """The round one, as it happens."""
    faces = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    faces.Next()
    faces.Next()
    return TopoDS.Face(faces.Current())


def _paint(colours: Any, label: Any, rgb: tuple[float, float, float]) -> None:
    colour = Quantity_Color(*rgb, Quantity_TypeOfColor.Quantity_TOC_sRGB)
    colours.SetColor(label, colour, XCAFDoc_ColorType.XCAFDoc_ColorSurf)


def write_ball(path: Path, radius: float) -> None:
    """A sphere (m) round the origin, its poles on the z axis."""
    writer = STEPControl_Writer()
    shape = BRepPrimAPI_MakeSphere(1e3 * radius).Shape()
    writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
    assert writer.Write(str(path)) == IFSelect_ReturnStatus.IFSelect_RetDone


if __name__ == "__main__":
    folder, (*size, radius) = Path(sys.argv[1]), map(float, sys.argv[2:])
    write_part(folder / "part.step", size, radius)
    write_part(folder / "pair.step", size, radius, "INCH", placed=True)
    write_ball(folder / "ball.step", 0.3)
