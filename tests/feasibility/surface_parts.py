"""The [surface] tables of cases, drawn at random: every kind, every key, only what is valid."""

from __future__ import annotations

import os

from hypothesis import strategies as st

from feasibility.cases.surface_keys import OWN_KEYS
from feasibility.cases.surface_pieces import PiecePart
from feasibility.cases.surface_table import SurfacePart

lengths = st.floats(0.01, 100)
triples = st.tuples(*[st.floats(-1e6, 1e6)] * 3)
grids = st.tuples(st.integers(1, 500), st.integers(1, 500))
paths = st.text("abc/é ._-", min_size=1, max_size=9).map(lambda name: os.path.abspath(f"x{name}"))
PROFILES = (
    ((0.2, 0.0), (0.3, 0.2), (0.1, 0.5)),
    ((0.0, -0.1), (0.3, 0.0), (0.35, 0.3)),
    ((1.0, 0.5), (1.0, 0.25)),
)


def pairs(low, high):
    """(a, b) with a < b."""
    both = st.tuples(st.floats(low, high), st.floats(low, high)).filter(lambda p: p[0] != p[1])
    return both.map(lambda p: (min(p), max(p)))


degrees, heights = pairs(0, 180), pairs(-100, 100)


@st.composite
def cones(draw):
    radius = draw(lengths)
    slope = draw(st.floats(-0.009, 0.009)) * radius  # the apex is beyond 100 m
    return {"radius": radius, "slope": slope, "u_deg": draw(degrees), "v": draw(heights)}


@st.composite
def toruses(draw):
    tube = draw(lengths)
    ring = tube * (1.0 + draw(lengths))
    return {"ring": ring, "tube": tube, "u_deg": draw(degrees), "v_deg": draw(degrees)}


@st.composite
def nets(draw):
    """A sheet with waves, its numbers in the case or in a file."""
    rows, columns = draw(st.integers(3, 5)), draw(st.integers(3, 5))
    if draw(st.booleans()):
        given = {"file": draw(paths)}
        degree = draw(st.integers(1, 9)), draw(st.integers(1, 9))
    else:
        z = st.floats(-0.2, 0.2)
        degree = (2, 2)
        given = {
            "points": tuple(
                tuple((float(i), float(j), draw(z)) for j in range(columns)) for i in range(rows)
            )
        }
    if "points" in given or draw(st.booleans()):
        given["degree"] = degree
    if draw(st.booleans()):
        weight = st.floats(0.8, 1.2)
        given["weights"] = tuple(tuple(draw(weight) for _ in range(columns)) for _ in range(rows))
    if draw(st.booleans()):
        given["u"] = draw(pairs(0, 1).filter(lambda p: p[1] - p[0] > 0.01))
    return given


PATCHES = {
    "sphere": {"radius": lengths, "u_deg": degrees, "v_deg": degrees},
    "cylinder": {"radius": lengths, "u_deg": degrees, "v": heights},
    "hyperboloid": {"radius": lengths, "flare": lengths, "u_deg": degrees, "v": heights},
    "plane": {"u": heights, "v": heights},
    "cone": cones(),
    "torus": toruses(),
    "ellipsoid": {"semi_axes": st.tuples(*[lengths] * 3), "u_deg": degrees, "v_deg": degrees},
    "revolution": {"profile": st.sampled_from(PROFILES), "v_deg": degrees},
    "bspline": nets(),
}
directions = triples.filter(lambda d: max(map(abs, d)) > 1e-6)
boxes = st.lists(heights, min_size=3, max_size=3).map(lambda sides: tuple(zip(*sides, strict=True)))


@st.composite
def meshes(draw):
    """(values, cells) of a mesh with some of its optional keys."""
    optional = {
        "scale": st.floats(1e-9, 1e9),
        "faces": st.lists(st.integers(0, 10**6), min_size=1, max_size=4).map(tuple),
        "box": boxes,
        "cut": st.builds(lambda p, n: {"point": p, "normal": n}, triples, directions),
        "facing": st.builds(
            lambda d, within: {"direction": d, "within_deg": within},
            directions,
            st.floats(0.001, 180),
        ),
    }
    if sized := draw(st.booleans()):
        optional["cell_size"] = lengths
    values = {"file": draw(paths)}
    for key in OWN_KEYS["mesh"][1:]:  # in the order in which they are written
        if key in optional and (key == "cell_size" or draw(st.booleans())):
            values[key] = draw(optional[key])
    return values, None if sized else draw(st.integers(1, 20_000))


@st.composite
def pieces(draw):
    """The values of a piecewise surface; whether its pieces touch is not looked at in reading."""
    found = []
    for _ in range(draw(st.integers(1, 3))):
        kind = draw(st.sampled_from(list(PATCHES)))
        found.append(
            PiecePart(kind, draw(values_of(kind)), draw(grids), draw(triples), draw(triples))
        )
    return {"pieces": tuple(found), **({"gap": draw(lengths)} if draw(st.booleans()) else {})}


def values_of(kind):
    """The own keys of a kind of patch."""
    keys = PATCHES[kind]
    return st.fixed_dictionaries(keys) if isinstance(keys, dict) else keys


@st.composite
def surfaces(draw):
    """A valid part of any kind."""
    kind = draw(st.sampled_from([*PATCHES, "piecewise", "mesh"]))
    if kind == "mesh":
        values, cells = draw(meshes())
    elif kind == "piecewise":
        values, cells = draw(pieces()), None
    else:
        values, cells = draw(values_of(kind)), draw(grids)
    return SurfacePart(
        kind,
        values,
        cells,
        side=draw(st.sampled_from(["inside", "outside"])),
        position=draw(triples),
        rpy_deg=draw(triples),
    )
