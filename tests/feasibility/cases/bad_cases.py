"""Case files that are wrong, with the key of a fault and words of its message."""

from __future__ import annotations

from typing import NamedTuple

GOOD = """\
[task]
standoff = 0.005
cone_deg = 45

[surface]
kind = "sphere"
radius = 1.0
u_deg = [10, 90]
v_deg = [10, 180]
cells = [9, 10]
side = "inside"

[robot]
name = "puma560"
limits = "set-1"
"""


class Bad(NamedTuple):
    """One bad file."""

    content: str | bytes
    key: str
    words: tuple[str, ...]


def write(folder, content, name="case.toml"):
    """The path of a new file with this content."""
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return str(path)


def changed(old, new, key, *words):
    """The good case with one line changed."""
    if GOOD.count(old) != 1:
        raise ValueError(f"{old!r} is not once in the good case")
    return Bad(GOOD.replace(old, new), key, words)


def added(table, line, key, *words):
    """The good case with one line more in a table."""
    if table == "search":
        return Bad(f"{GOOD}\n[search]\n{line}\n", key, words)
    return changed(f"[{table}]\n", f"[{table}]\n{line}\n", key, *words)


PLANE = GOOD.replace('kind = "sphere"\nradius = 1.0\nu_deg = [10, 90]\nv_deg = [10, 180]\n', "{}")


def surface(text, *changes):
    """The good case with another surface; each change replaces a part of `text`, once."""
    for old, new in changes:
        if text.count(old) != 1:
            raise ValueError(f"{old!r} is not once in the surface")
        text = text.replace(old, new)
    head, rest = GOOD.split("[surface]\n")
    return f"{head}[surface]\n{text}\n[robot]{rest.split('[robot]')[1]}"


# One good [surface] table of each kind that the paper does not have.
SURFACES = {
    "grid": """
kind = "grid"
file = "points.npy"
units = "mm"
side = "outside"
cells = [3, 4]
""",
    "poses": """
kind = "poses"
file = "toolpath.csv"
units = "mm"
side = "outside"
""",
    "cone": """
kind = "cone"
radius = 0.2
slope = -0.5
u_deg = [0, 90]
v = [0.0, 0.3]
cells = [3, 4]
""",
    "torus": """
kind = "torus"
ring = 0.5
tube = 0.125
u_deg = [0, 90]
v_deg = [-180, 180]
cells = [3, 4]
""",
    "ellipsoid": """
kind = "ellipsoid"
semi_axes = [1.0, 0.8, 0.5]
u_deg = [10, 90]
v_deg = [0, 360]
cells = [3, 4]
""",
    "revolution": """
kind = "revolution"
profile = [[0.2, 0.0], [0.3, 0.2], [0.1, 0.5]]
v_deg = [0, 180]
cells = [3, 4]
""",
    "bspline": """
kind = "bspline"
points = [[[0, 0, 0], [0, 1, 0], [0, 2, 0]], [[1, 0, 0.2], [1, 1, 0], [1, 2, 0]],
          [[2, 0, 0], [2, 1, 0], [2, 2, 0]]]
degree = [2, 2]
cells = [3, 4]
""",
    "piecewise": """
kind = "piecewise"
pieces = [
  { kind = "plane", u = [0, 1], v = [0, 1], cells = [2, 3] },
  { kind = "plane", u = [0, 1], v = [0, 1], position = [1, 0, 0], cells = [2, 3] },
]
""",
    "step": """
kind = "step"
file = "part.step"
faces = [1]
side = "outside"
cells = 12
""",
    "mesh": """
kind = "mesh"
file = "part.stl"
side = "outside"
cells = 12
""",
}


def wrong(kind, old, new, key, *words):
    """A good surface of another kind with one part replaced."""
    return Bad(surface(SURFACES[kind], (old, new)), f"surface.{key}" if key else "surface", words)


def more(kind, line, key, *words):
    """A good surface of another kind with one line more."""
    return Bad(surface(SURFACES[kind] + line), f"surface.{key}" if key else "surface", words)


PAIR = "must be a pair (low, high) of finite numbers with low < high "

BAD_CASES = {
    # the file as a whole
    "empty": Bad("", "robot", ("is missing", "[robot]")),
    "not toml": Bad("robot: puma560\n", "", ("is not valid TOML", "line 1")),
    "xml": Bad("<robot name='x'/>", "", ("is not valid TOML",)),
    "unclosed string": changed('"inside"', '"inside', "", "is not valid TOML", "line 11"),
    "key twice": added("task", "cone_deg = 4", "", "is not valid TOML"),
    "binary": Bad(b"\x7fELF\x02\x01\x01\x00\xff\xfe" * 50, "", ("is not text in UTF-8",)),
    "utf-16": Bad(GOOD.encode("utf-16"), "", ("is not text in UTF-8",)),
    "NUL": Bad(GOOD + "\0", "", ("is not valid TOML",)),
    "huge": Bad(GOOD + "#" * 300_000, "", ("is larger than 256 kB",)),
    "nested too deeply": Bad("a = " + "[" * 20_000, "", ("is nested too deeply",)),
    "a key without end": Bad("a." * 60_000 + "b = 1", "", ("is nested too deeply",)),
    "digits without end": Bad("a = " + "9" * 20_000, "", ("is not valid TOML",)),
    # tables
    "table missing": Bad(GOOD.replace("[task]", "[tusk]"), "task", ("is missing", '"task"')),
    "table is a number": Bad("task = 5\n" + GOOD[GOOD.index("[surface]") :], "task", ("table",)),
    "table is an array": Bad(GOOD.replace("[robot]", "[[robot]]"), "robot", ("must be a table",)),
    "unknown table": Bad(GOOD + "[serach]\nseed = 1\n", "serach", ('did you mean "search"?',)),
    "odd key": added("task", '"a\\nb\\u001b" = 1', "task.'a\\nb\\x1b'", "is not known here"),
    # robot
    "no robot": changed('name = "puma560"\n', "", "robot.name", "is missing"),
    "name and urdf": added("robot", 'urdf = "a.urdf"', "robot.name", "contradicts robot.urdf"),
    "unknown robot": changed('"puma560"', '"puma561"', "robot", "'puma561'", "'puma560'"),
    "path as a name": changed('"puma560"', '"arms/my.urdf"', "robot.name", "write urdf ="),
    "empty name": changed('"puma560"', '" "', "robot.name", "must be the name of a robot"),
    "name is a number": changed('"puma560"', "560", "robot.name", "got 560"),
    "missing urdf": changed('name = "puma560"', 'urdf = "no.urdf"', "robot", "no.urdf"),
    "unknown limit set": changed('"set-1"', '"set-9"', "robot", "'set-9'", "set-4"),
    "limits twice": added(
        "robot", "limits_deg = { joint4 = [-9, 9] }", "robot.limits", "contradicts robot.limits_deg"
    ),
    "limits as pairs": changed('"set-1"', "[[0, 1]]", "robot.limits", "the name of a limit set"),
    "limits of too few joints": changed(
        'limits = "set-1"', "limits_deg = [[-90, 90]]", "robot", "(6, 2)"
    ),
    "limits reversed": changed(
        'limits = "set-1"',
        "limits_deg = { joint4 = [90, -90] }",
        "robot.limits_deg.joint4",
        "the wrong way round",
    ),
    "limits empty": changed(
        'limits = "set-1"', "limits_deg = { joint4 = [9, 9] }", "robot.limits_deg.joint4", "empty"
    ),
    "limits NaN": changed(
        'limits = "set-1"', "limits_deg = [[-90, nan]]", "robot.limits_deg[0]", "finite numbers"
    ),
    "limits infinite": changed(
        'limits = "set-1"', "limits_deg = [[-inf, inf]]", "robot.limits_deg[0]", "finite"
    ),
    "limits are words": changed(
        'limits = "set-1"', 'limits_deg = "wide"', "robot.limits_deg", "an array of [low, high]"
    ),
    "limits of an unknown joint": changed(
        'limits = "set-1"', "limits_deg = { elbow = [-9, 9] }", "robot", "'elbow'", "joint1"
    ),
    "list and metres": changed(
        'limits = "set-1"',
        "limits_deg = [[-9, 9]]\nlimits_m = { a = [0, 1] }",
        "robot.limits_m",
        "contradicts the list",
    ),
    "degrees and metres": changed(
        'limits = "set-1"',
        "limits_deg = { a = [-9, 9] }\nlimits_m = { a = [0, 1] }",
        "robot.limits_m.a",
        "contradicts robot.limits_deg",
    ),
    "locked and limited": changed(
        'limits = "set-1"',
        "limits_deg = { joint6 = [-9, 9] }\nlock = { joint6 = 0.0 }",
        "robot.lock.joint6",
        "contradicts the limits",
    ),
    "lock is a word": added("robot", 'lock = { joint6 = "shut" }', "robot.lock.joint6", "'shut'"),
    "lock is a list": added("robot", 'lock = ["joint6"]', "robot.lock", "a table of joints"),
    "lock unknown": added("robot", "lock = { finger = 0.0 }", "robot", "'finger'"),
    "unknown tool": added("robot", 'tool_frame = "tool0"', "robot", "no link 'tool0'"),
    "axis is zero": added("robot", "approach_axis = [0, 0, 0]", "robot.approach_axis", "all zero"),
    "axis is flat": added("robot", "approach_axis = [0, 1]", "robot.approach_axis", "three finite"),
    "folders": added("robot", 'package_dirs = "meshes"', "robot.package_dirs", "an array of"),
    # surface
    "no kind": changed('kind = "sphere"\n', "", "surface.kind", "is missing", "'plane'"),
    "misspelt kind": changed('"sphere"', '"shpere"', "surface.kind", 'did you mean "sphere"?'),
    "a formula of one's own": changed(
        '"sphere"',
        '"parametric"',
        "surface.kind",
        "g(u, v)",
        "as a grid",
        "as a mesh",
        "surfaces.parametric",
    ),
    "kind is a list": changed('"sphere"', '["sphere"]', "surface.kind", "must be"),
    "mesh key": added(
        "surface", "cell_size = 0.1", "surface.cell_size", "belongs to a mesh or STEP faces"
    ),
    "file of nothing": added(
        "surface",
        'file = "part.stl"',
        "surface.file",
        "a bspline, a grid, poses, a mesh or STEP faces, not to a sphere",
    ),
    "key of another kind": added("surface", "flare = 1.0", "surface.flare", "belongs to a hyper"),
    "radius missing": changed("radius = 1.0\n", "", "surface.radius", "is missing", "metres"),
    "radius zero": changed("radius = 1.0", "radius = 0", "surface.radius", "> 0"),
    "radius true": changed("radius = 1.0", "radius = true", "surface.radius", "got True"),
    "radius NaN": changed("radius = 1.0", "radius = nan", "surface.radius", "got nan"),
    "radius infinite": changed("radius = 1.0", "radius = inf", "surface.radius", "got inf"),
    "radius too large a whole number": changed(
        "radius = 1.0", "radius = 0x" + "F" * 9000, "surface.radius", "thousands of digits"
    ),
    "radius is a date": changed("radius = 1.0", "radius = 2026-01-01", "surface.radius", "date"),
    "range reversed": changed("[10, 90]", "[90, 10]", "surface.u_deg", "the wrong way round"),
    "range empty": changed("[10, 90]", "[10, 10.0]", "surface.u_deg", "an empty range"),
    "range of three": changed("[10, 90]", "[10, 20, 90]", "surface.u_deg", PAIR + "(degrees)"),
    "range beyond the pole": changed("[10, 90]", "[10, 190]", "surface.u_deg", "must lie in 0"),
    "more than a turn": changed("[10, 180]", "[0, 400]", "surface.v_deg", "must span at most"),
    "metres for degrees": changed("u_deg = [10, 90]", "u = [0, 1]", "surface.u", "write u_deg"),
    "degrees for metres": Bad(
        PLANE.format('kind = "plane"\nu_deg = [0, 90]\nv = [0, 1]\n'),
        "surface.u_deg",
        ("write u in metres",),
    ),
    "plane with a radius": Bad(
        PLANE.format('kind = "plane"\nradius = 1.0\nu = [0, 1]\nv = [0, 1]\n'),
        "surface.radius",
        ("not to a plane",),
    ),
    "flare beyond reason": Bad(
        PLANE.format(
            'kind = "hyperboloid"\nradius = 1.0\nflare = 1e-9\nu_deg = [0, 90]\nv = [0, 1]\n'
        ),
        "surface.flare",
        ("must be within a factor of 1e+06 of the radius",),
    ),
    "side": changed('"inside"', '"in side"', "surface.side", 'did you mean "inside"?'),
    "position": added("surface", "position = [0, 0]", "surface.position", "three finite numbers"),
    "rotation": added("surface", 'rpy_deg = "up"', "surface.rpy_deg", "three finite numbers"),
    "cells missing": changed("cells = [9, 10]\n", "", "surface.cells", "is missing"),
    "cells as a count": changed("[9, 10]", "90", "surface.cells", "two whole numbers"),
    "cells as floats": changed("[9, 10]", "[9.0, 10.0]", "surface.cells[1]", "a whole number"),
    "cells negative": changed("[9, 10]", "[-9, 10]", "surface.cells[0]", "a whole number >= 1"),
    "no cells along u": changed("[9, 10]", "[0, 3]", "surface.cells[0]", ">= 1", "got 0"),
    "no cells along v": changed("[9, 10]", "[3, 0]", "surface.cells[1]", ">= 1", "got 0"),
    "no cells at all": changed("[9, 10]", "[0, 0]", "surface.cells[1]", ">= 1", "got 0"),
    "cells true": changed("[9, 10]", "[true, 10]", "surface.cells[0]", "got True"),
    "too many cells": changed("[9, 10]", "[9000, 10000]", "surface.cells", "coarser grid"),
    "cells without end": changed("[9, 10]", f"[0, 0x{'F' * 9000}]", "surface.cells[1]", "64 bits"),
    # other kinds of surface
    "slope missing": wrong("cone", "slope = -0.5\n", "", "slope", "is missing", "metres of radius"),
    "slope beyond reason": wrong("cone", "-0.5", "1e7", "slope", "1e+06", "got 10000000.0"),
    "slope is text": wrong("cone", "-0.5", '"steep"', "slope", "got 'steep'"),
    "apex": wrong("cone", "[0.0, 0.3]", "[0.0, 0.5]", "v", "must end before the apex", "z = 0.4"),
    "slope of a sphere": added("surface", "slope = 1", "surface.slope", "belongs to a cone"),
    "tube too thick": wrong("torus", "0.125", "0.5", "tube", "must be less than ring"),
    "tube missing": wrong("torus", "tube = 0.125\n", "", "tube", "is missing"),
    "torus more than a turn": wrong("torus", "[-180, 180]", "[-180, 190]", "v_deg", "must span"),
    "torus with a radius": more("torus", "radius = 1", "radius", "not to a torus"),
    "two semi-axes": wrong("ellipsoid", "[1.0, 0.8, 0.5]", "[1.0, 0.8]", "semi_axes", "three"),
    "semi-axis zero": wrong("ellipsoid", "0.8", "0", "semi_axes[1]", "> 0"),
    "ellipsoid beyond the pole": wrong("ellipsoid", "[10, 90]", "[10, 181]", "u_deg", "must lie"),
    "flat ellipsoid": wrong("ellipsoid", "0.5]", "1e-9]", "semi_axes", "within a factor of 1e+06"),
    "profile of one point": wrong(
        "revolution",
        "[[0.2, 0.0], [0.3, 0.2], [0.1, 0.5]]",
        "[[0.2, 0.0]]",
        "profile",
        "must hold points",
    ),
    "profile through the axis": wrong(
        "revolution", "[0.3, 0.2]", "[-0.3, 0.2]", "profile[1]", "clear of the axis"
    ),
    "profile with NaN": wrong("revolution", "[0.3, 0.2]", "[nan, 0]", "profile[1][0]", "got nan"),
    "profile is ragged": wrong("revolution", "[0.3, 0.2]", "[0.3]", "profile", "rows of one"),
    "profile is text": wrong(
        "revolution", "[[0.2, 0.0], [0.3, 0.2], [0.1, 0.5]]", '"a.csv"', "profile", "got str"
    ),
    "revolution with u": more("revolution", "u = [0, 1]", "u", "belongs to", "not to a revolution"),
    "no net": Bad(
        surface('kind = "bspline"\ncells = [3, 4]'), "surface.points", ("is missing", "net.json")
    ),
    "net twice": more("bspline", 'file = "net.json"', "points", "contradicts surface.file"),
    "net with a word": wrong("bspline", "0.2]", '"up"]', "points[1][0][2]", "got 'up'"),
    "net is flat": wrong("bspline", "[[0, 0, 0], [0, 1, 0], [0, 2, 0]]", "3", "points[0]", "list"),
    "net folds": wrong("bspline", "[1, 0, 0.2], [1, 1, 0]", "[9, 0, 0], [-9, 1, 0]", "", "patch"),
    "degree of one": wrong("bspline", "[2, 2]\n", "[2]\n", "degree", "two whole numbers"),
    "degree zero": wrong("bspline", "[2, 2]\n", "[0, 2]\n", "degree", "1 .. 9"),
    "degree too high": wrong("bspline", "[2, 2]\n", "[3, 2]\n", "points", "lower the degree"),
    "knots of u only": more("bspline", "knots = [[0, 0, 0, 1, 1, 1]]", "knots", "two lists"),
    "knots that fall": more(
        "bspline", "knots = [[0, 0, 0, 1, 0, 1], [0, 0, 0, 1, 1, 1]]", "knots[0]", "must never fall"
    ),
    "knots with NaN": more(
        "bspline", "knots = [[0, 0, 0, nan, 1, 1], [0, 0, 0, 1, 1, 1]]", "knots[0][3]", "got nan"
    ),
    "weights negative": more(
        "bspline", "weights = [[1, 1, 1], [1, -1, 1], [1, 1, 1]]", "weights", "must be > 0"
    ),
    "weights are a number": more("bspline", "weights = 2", "weights", "must be a list"),
    "range of no knots": more("bspline", "u = [0, 2]", "u", "must be a pair"),
    "range of knots in degrees": more("bspline", "u_deg = [0, 1]", "u_deg", "write u in the num"),
    "missing net": Bad(
        surface('kind = "bspline"\nfile = "no/net.json"\ncells = [3, 4]'),
        "surface.file",
        ("no/net.json: there is no such file; expected a control net",),
    ),
    "net of a strange kind": Bad(
        surface('kind = "bspline"\nfile = "net.npy"\ncells = [3, 4]'),
        "surface.file",
        (".json or a .csv",),
    ),
    "net is a device": Bad(
        surface('kind = "bspline"\nfile = "/dev/zero"\ncells = [3, 4]'), "surface.file", (".csv",)
    ),
    # pieces
    "no pieces": Bad(surface('kind = "piecewise"'), "surface.pieces", ("is missing", "a patch")),
    "pieces are a table": Bad(
        surface('kind = "piecewise"\npieces = { a = 1 }'),
        "surface.pieces",
        ("1 to 200 tables [[surface.pieces]]",),
    ),
    "pieces without end": Bad(
        surface(f'kind = "piecewise"\npieces = [{"{}, " * 300}]'), "surface.pieces", ("to 200",)
    ),
    "piece is a number": Bad(
        surface('kind = "piecewise"\npieces = [3]'), "surface.pieces[0]", ("must be a table",)
    ),
    "piece of no kind": Bad(
        surface('kind = "piecewise"\npieces = [{ cells = [1, 1] }]'),
        "surface.pieces[0].kind",
        ("is missing",),
    ),
    "piece is a mesh": Bad(
        surface('kind = "piecewise"\npieces = [{ kind = "mesh" }]'),
        "surface.pieces[0].kind",
        ("'bspline' or 'grid', got",),
    ),
    "piece with a side": wrong(
        "piecewise",
        "position = [1, 0, 0]",
        'side = "inside"',
        "pieces[1].side",
        "is that of all pieces",
    ),
    "piece without cells": wrong(
        "piecewise", "[1, 0, 0], cells = [2, 3]", "[1, 0, 0]", "pieces[1].cells", "is missing"
    ),
    "piece with a radius": wrong(
        "piecewise", "position = [1, 0, 0]", "radius = 1", "pieces[1].radius", "not to a plane"
    ),
    "piece of a missing net": Bad(
        surface(
            'kind = "piecewise"\npieces = [{ kind = "bspline", file = "n.json", cells = [1, 1] }]'
        ),
        "surface.pieces[0].file",
        ("n.json: there is no such file",),
    ),
    "piece beyond the pole": Bad(
        surface(
            'kind = "piecewise"\npieces = [{ kind = "sphere", radius = 1, u_deg = [0, 181], '
            "v_deg = [0, 9], cells = [1, 1] }]"
        ),
        "surface.pieces[0].u_deg",
        ("must lie in",),
    ),
    "piece of no cells": wrong(
        "piecewise",
        "[1, 0, 0], cells = [2, 3]",
        "[1, 0, 0], cells = [2, 0]",
        "pieces[1].cells[1]",
        "got 0",
    ),
    "cells of the whole": more("piecewise", "cells = [2, 3]", "cells", "in each of surface.pieces"),
    "gap": more("piecewise", "gap = 0", "gap", "> 0"),
    "gap too wide": more("piecewise", "gap = 0.5", "gap", "must be at most a fiftieth"),
    "pieces of a sphere": added("surface", "pieces = []", "surface.pieces", "a piecewise surface"),
    "too many cells in all": wrong(
        "piecewise",
        "[1, 0, 0], cells = [2, 3]",
        "[1, 0, 0], cells = [1000, 1000]",
        "pieces",
        "coarser grids",
    ),
    "three pieces at one seam": wrong(
        "piecewise",
        "position = [1, 0, 0], cells = [2, 3] },",
        'position = [1, 0, 0], cells = [2, 3] },\n  { kind = "plane", u = [0, 1], v = [0, 1], '
        "position = [1, 0, 0], rpy_deg = [0, 45, 0], cells = [2, 3] },",
        "",
        "share one seam",
    ),
    # meshes
    "mesh without a file": wrong("mesh", 'file = "part.stl"\n', "", "file", "is missing", "STL"),
    "missing mesh": more("mesh", "", "file", "part.stl: there is no such file"),
    "mesh of a strange kind": wrong("mesh", "part.stl", "case.toml", "file", "STL, OBJ"),
    "mesh is a device": wrong("mesh", "part.stl", "/dev/zero", "file", "not a regular file"),
    "mesh is a number": wrong("mesh", '"part.stl"', "3", "file", "must be the path of a mesh"),
    "no side": wrong("mesh", 'side = "outside"\n', "", "side", "where the faces look to"),
    "cells of a grid": wrong("mesh", "12", "[3, 4]", "cells", "a whole number in 1 .. 20,000"),
    "cells of a mesh missing": wrong("mesh", "cells = 12\n", "", "cells", "or cell_size = 0.05"),
    "no cell": wrong("mesh", "12", "0", "cells", "1 .. 20,000"),
    "too many cells of a mesh": wrong("mesh", "12", "20_001", "cells", "1 .. 20,000"),
    "cells of a mesh true": wrong("mesh", "12", "true", "cells", "got True"),
    "cells and their size": more("mesh", "cell_size = 0.1", "cells", "contradicts"),
    "size of cells zero": wrong("mesh", "cells = 12", "cell_size = 0", "cell_size", "> 0"),
    "scale zero": more("mesh", "scale = 0", "scale", "0.001 for millimetres"),
    "scale is text": more("mesh", 'scale = "mm"', "scale", "got 'mm'"),
    "mesh with a radius": more("mesh", "radius = 1", "radius", "belongs to", "not to a mesh"),
    "mesh with angles": more("mesh", "u_deg = [0, 1]", "u_deg", "belongs to", "not to a mesh"),
    "box reversed": more(
        "mesh", "box = [[0, 0, 0], [1, 0, 1]]", "box[0]", "below the opposite corner"
    ),
    "box of one corner": more("mesh", "box = [[0, 0, 0]]", "box", "[[x0, y0, z0], [x1, y1, z1]]"),
    "box infinite": more("mesh", "box = [[0, 0, 0], [inf, 1, 1]]", "box[1]", "got [inf"),
    "cut is a list": more("mesh", "cut = [0, 0, 1]", "cut", "must be a table"),
    "cut without a normal": more("mesh", "cut = { point = [0, 0, 0] }", "cut.normal", "missing"),
    "cut along nothing": more(
        "mesh", "cut = { point = [0, 0, 0], normal = [0, 0, 0] }", "cut.normal", "not all zero"
    ),
    "cut with a typo": more(
        "mesh", "cut = { piont = [0, 0, 0], normal = [0, 0, 1] }", "cut.piont", 'mean "point"?'
    ),
    "facing too wide": more(
        "mesh", "facing = { direction = [0, 0, 1], within_deg = 200 }", "facing.within_deg", "180"
    ),
    "facing without an angle": more(
        "mesh", "facing = { direction = [0, 0, 1] }", "facing.within_deg", "is missing"
    ),
    "no faces": more("mesh", "faces = []", "faces", "an array of whole numbers"),
    "faces negative": more("mesh", "faces = [0, -1]", "faces[1]", "got -1"),
    "faces beyond reason": more("mesh", f"faces = [{2**70}]", "faces[0]", "whole number >= 0"),
    # task
    "standoff missing": changed("standoff = 0.005\n", "", "task.standoff", "is missing"),
    "standoff negative": changed("0.005", "-0.005", "task.standoff", ">= 0"),
    "standoff is text": changed("0.005", '"5 mm"', "task.standoff", "got '5 mm'"),
    "cone too wide": changed("= 45", "= 181", "task.cone_deg", "0 .. 180"),
    "cone in radians": changed("cone_deg", "cone", "task.cone", 'did you mean "cone_deg"?'),
    "tolerance zero": added("task", "tolerance = 0", "task.tolerance", "> 0"),
    "approach in words": added("task", 'approach = "down"', "task.approach", "got 'down'"),
    "approach of no length": added("task", "approach = [0, 0, 0]", "task.approach", "not all zero"),
    "roll wrong way round": added("task", "roll_deg = [15, -15]", "task.roll_deg", "is empty"),
    "reference of two": added("task", "roll_reference = [0, 1]", "task.roll_reference", "three"),
    # search
    "method": added("search", 'method = "compleat"', "search.method", 'did you mean "complete"?'),
    "seed": added("search", "seed = -1", "search.seed", ">= 0"),
    "seed beyond 64 bits": added("search", f"seed = {2**63}", "search.seed", "a whole number"),
    "time limit": added("search", "time_limit = 0", "search.time_limit", "> 0"),
    "time limit infinite": added("search", "time_limit = inf", "search.time_limit", "> 0"),
    "step": added("search", "step_deg = 0", "search.step_deg", "0.0001 .. 30"),
    "moves": added("search", "moves = 1", "search.moves", "must be"),
    "starts": added("search", 'starts = "some"', "search.starts", "'all' or a whole number"),
    "starts zero": added("search", "starts = 0", "search.starts", ">= 1"),
    "cap": added("search", "cap = 1e5", "search.cap", "a whole number >= 1"),
}
