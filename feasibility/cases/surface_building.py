"""From the values of a [surface] table to a patch, and from a surface to its cells."""

from __future__ import annotations

import math
from collections.abc import Collection, Generator, Mapping
from contextlib import contextmanager
from typing import Any, Final

import numpy as np

from coverable.errors import MISSING, Fault, worded
from feasibility.cases.keys import own_keys
from feasibility.cases.table_reader import CaseError, with_example
from feasibility.read_files import shown_path

AUTO: Final = "auto"
FILES = ("bspline", "grid", "poses", "mesh", "step")  # kinds of surface that may be a file
MOST_CELLS = 1_000_000  # the graph of a verdict takes some kilobytes a cell
MOST_MESH_CELLS = 20_000  # as `surfaces.meshes.cells` has it
WIDTH = 0.65  # [1] of the footprint: the corners of a square are 0.46 of it from its centre
UNEVEN = 0.5  # [1] of the footprint, of cells of a mesh, which are no squares
SURFACE_NAMES = {
    "low": "box[0]", "high": "box[1]", "half_angle_deg": "within_deg", "count": "cells",
    "size": "cell_size",
}  # fmt: skip
"""Keys of a surface that are called otherwise in Python."""
OR_FILE = ', or give file = "net.json" or "net.csv"'

Footprint = tuple[float, float]
Values = Mapping[str, Any]


@contextmanager
def faults_of(
    place: str, key: str = "", kind: str = "", file: str | None = None, own: Collection[str] = ()
) -> Generator[None]:
    """Turn faults of a surface into faults of the case.

    Args:
        place: the table.
        key: whose those without one are.
        kind: of surface, whose arguments have other names.
        file: where faults lie that are of none of the keys `own`; without a kind those of these
            keys name it, too, since it says what they may be.

    Raises:
        CaseError: what happens inside is a fault.
    """
    from surfaces.surface import SurfaceError

    try:
        yield
    except SurfaceError as error:
        keys = own_keys(kind) if kind else {}
        names = SURFACE_NAMES | {one.argument: one.name for one in keys.values()}
        faults = []
        for fault in error.faults:
            fault = fault._replace(key=fault.key or key)
            renamed = with_example(fault.renamed(names), keys)
            if file is not None and renamed.key.partition("[")[0] not in own:
                faults.append(Fault(f"{place}.file", worded(fault), shown_path(file)))
            else:
                at = shown_path(file) if file is not None and not kind else ""
                faults.append(renamed._replace(place=at or renamed.place).renamed({}, place))
        raise CaseError(faults) from error


def build_patch(kind: str, values: Values, pose: Values, place: str = "surface") -> Any:
    """Build a patch from its numbers; a control net may be in a file.

    Args:
        kind: of surface.
        values: of the keys of that kind.
        pose: those of `side`, `position` and `rpy_deg` that are written.
        place: where in the case, for messages.

    Raises:
        CaseError: the values describe no surface, or the file cannot be used.
    """
    import coverable

    file, keys = values.get("file"), own_keys(kind)
    arguments = {
        key.argument: values.get(key.name, MISSING)
        for key in keys.values()
        if key.name != "file"
        and (key.name in values or key.default is None or key.name == "points")
    }
    try:
        with faults_of(place, "", kind, file, {**values, **pose}):
            if file is not None:  # what the case says replaces what the file says
                from surfaces.fitted.control_net_file import read_net

                arguments.pop("points", None)
                arguments = read_net(file)._asdict() | arguments
            return getattr(coverable, kind)(**arguments, **pose)
    except CaseError as error:
        missing = f"{place}.points" if kind == "bspline" and "points" not in values else None
        faults = [
            f._replace(expected=f.expected + OR_FILE * (f.key == missing)) for f in error.faults
        ]
        raise CaseError(faults) from error


def cut_surface(made: Any, cells: Any, values: Values, footprint: Footprint | None) -> Any:
    """A surface, as it was built, cut into cells.

    Raises:
        CaseError: it cannot be cut so.
    """
    if "pieces" in values:
        parts = zip(made.placed, values["pieces"], strict=True)
        grids = [_grid_of(patch, piece.cells, footprint) for patch, piece in parts]
        with faults_of("surface", "pieces"):
            return made.cells(grids)
    if not hasattr(made, "cells"):  # poses are cells
        return made
    if not hasattr(made, "mesh"):
        return made.cells(*_grid_of(made, cells, footprint))
    if cells == AUTO and footprint is not None:
        area = float(np.sum(made.mesh.area))
        cells = max(1, math.ceil(area / (UNEVEN * min(footprint)) ** 2))
        _check_automatic(cells, footprint, MOST_MESH_CELLS)
    size = values.get("cell_size")
    with faults_of("surface", "cells" if size is None else "cell_size"):
        return made.cells(count=cells, size=size)


def _grid_of(
    patch: Any, cells: tuple[int, int] | str, footprint: Footprint | None
) -> tuple[int, int]:
    """Cells along u and v of a patch, as given or fine enough for a footprint (m)."""
    if isinstance(cells, tuple):
        return cells
    if footprint is None:
        raise CaseError([Fault("surface.cells", f"is {AUTO!r}, without a footprint")])
    from surfaces.passes.triangulation import grid_shape

    nu, nv = grid_shape(patch, WIDTH * min(footprint))
    _check_automatic(nu * nv, footprint, MOST_CELLS)
    return nu, nv


def _check_automatic(count: int, footprint: Footprint, most: int) -> None:
    """Refuse more cells than a surface may have."""
    if count > most:
        what = (
            f"is {AUTO!r}, which makes {count:,} cells for a footprint of "
            f"{1e3 * min(footprint):.3g} mm, more than {most:,}"
        )
        wanted = "give their number yourself, or a larger footprint"
        raise CaseError([Fault("surface.cells", what, expected=wanted)])
