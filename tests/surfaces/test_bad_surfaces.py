"""Numbers, nets, grids, poses and files that make no surface: what is said of each is approved."""

import csv
import json
import math

import numpy as np
import pytest
from approved import refused
from bad_input import net_csv
from readers import npy
from smooth_probes import same_surface
from specimens import WEIGHTS, ball, hood, sampled

import coverable
from coverable import bspline, grid, hyperboloid, parametric, piecewise, plane, poses, revolution

NAN, INF = math.nan, math.inf
TURN = {"angle_deg": (0, 90), "height": (0, 1)}
LENGTHS = (0, -2.0, NAN, INF, "1", True, 10**400, None)
RANGES = ((90, 90), (90, 10), (0, NAN), (0,), "ab", 90, (0, None), (0, 361), (-400, 0))
# Of each kind what makes one, and what does not in its place.
KINDS = {
    coverable.sphere: (
        {"radius": 1, "polar_deg": (10, 90), "azimuth_deg": (10, 180)},
        {"radius": LENGTHS, "polar_deg": (*RANGES, (-1, 90), (0, 181)), "azimuth_deg": RANGES,
         "side": ("top", None, 3, [], np.array([1, 2]), np.array(["inside"])),
         "position": ((0, 0), (0, 0, INF), "x"), "rpy_deg": ((0, NAN, 0), None)},
    ),
    coverable.cylinder: ({"radius": 1, **TURN}, {"radius": (1e-300,), "angle_deg": ((-200, 200),),
                                       "height": ((1, 0), (0, INF))}),
    hyperboloid: ({"waist": 1, "flare": 2, **TURN}, {"waist": (0,), "flare": (-1, 1e9, 1e-9)}),
    plane: ({"width": (0, 1), "length": (0, 1)}, {"width": ((0, 0),), "length": ((1, 0),)}),
    coverable.cone: ({"radius": 1, "slope": -0.5, **TURN},
           {"radius": (0,), "slope": (NAN, "1", 1e7), "height": ((0, 2), (3, 4))}),
    coverable.torus: ({"ring": 1, "tube": 0.2, "u_deg": (0, 90), "v_deg": (0, 90)},
            {"ring": (INF, 0.2), "tube": (1, 1e-8), "v_deg": ((90, 0),)}),
    coverable.ellipsoid: ({"semi_axes": (1, 1, 1), "polar_deg": (0, 90), "azimuth_deg": (0, 90)},
                {"semi_axes": ((1, 2), (1, 0, 1), (1, 1, 1e-7)), "polar_deg": ((-1, 90),)}),
}  # fmt: skip


@pytest.mark.parametrize("make", KINDS, ids=lambda make: make.__name__)
def test_bad_numbers(make, approved):
    good, bad = KINDS[make]
    assert make(**good).kind == make.__name__
    lines = [
        f"{key}={str(value)[:60]}: {refused(make, **{**good, key: value})}"
        for key, values in bad.items() for value in values
    ]  # fmt: skip
    lines.append("all: " + refused(make, **good | {key: v[0] for key, v in bad.items()}))
    approved(f"bad_{make.__name__}", "\n".join(lines))


PROFILES = {
    "one point": [(1, 0)], "no points": [], "not pairs": [(1, 0, 0), (1, 1, 0)],
    "ragged": [(1, 0), (1,)], "a word": "vase", "NaN": [(1, 0), (NAN, 1), (1, 2)],
    "a word within": [(1, 0), (1, "x")], "through the axis": [(1, 0), (-0.5, 1), (1, 2)],
    "on the axis within": [(1, 0), (0, 1), (1, 2)],
    "dips below between": [(1, 0), (0.01, 0.1), (0.01, 1.0), (1, 1.1)],
    "twice": [(1, 0), (1, 0), (1, 1)], "closed": [(1, 0), (2, 0), (2, 1), (1, 0)],
    "crossing": [(1, 0), (2, 1), (2, 0), (1, 1)], "back and forth": [(1, 0), (1, 1), (1, 0.5)],
    "along the axis": [(0, 0), (0, 1)], "too many": np.ones((1001, 2)),
    "a billion": np.broadcast_to(1.0, (500_000_000, 2)), "huge": [(1e300, 0), (1e300, 1e300)],
}  # fmt: skip


def test_bad_profiles(approved):
    lines = [f"{name}: {refused(revolution, p, (0, 90))}" for name, p in PROFILES.items()]
    lines.append("all: " + refused(revolution, PROFILES["NaN"], (0, 400), side=1, rpy_deg=None))
    approved("bad_profiles", "\n".join(lines))


def changed(place, value):
    points = hood().tolist()
    points[place[0]][place[1]] = value
    return points


def folded():
    points = hood()
    points[2, :, 0], points[3, :, 0] = points[3, :, 0].copy() + 0.6, points[2, :, 0].copy() - 0.6
    return points


RIDGE = [[(x, y, z) for y in (0, 1.0)] for x, z in [(0, 0), (1, 0), (2, 0), (3, 1), (4, 2)]]
POLE = np.array([[(0, 0, 1.0)] * 4, *(hood()[1:4, :4])])
NETS = {
    "not a list": {"points": "net"}, "empty": {"points": []},
    "nothing": {"points": np.zeros((0, 0, 3)), "weights": []},
    "one row": {"points": hood()[:1]}, "few columns": {"points": hood()[:, :2]},
    "ragged": {"points": [*hood().tolist(), [(0, 0, 0)]]}, "flat": {"points": hood()[:, :, :2]},
    "too deep": {"points": [hood().tolist()]}, "NaN": {"points": changed((2, 3), (0, NAN, 1))},
    "a word": {"points": changed((0, 1), ("x", 0, 1))},
    "a truth": {"points": changed((0, 1), (True, 0, 1))},
    "no point": {"points": changed((0, 1), None)}, "far": {"points": hood() * 1e9},
    "a billion": {"points": np.broadcast_to(1.0, (10_000, 33_334, 3))},
    "many": {"points": [[(0, 0, 0)] * 300] * 300},
    "strings": {"points": np.full((4, 4, 3), "1")}, "complex": {"points": hood().astype(complex)},
    "a mapping": {"points": {"0": 1}},
    "degree 0": {"degree": (0, 3)}, "degree 2.5": {"degree": (2.5, 3)},
    "one degree": {"degree": 3}, "degree 10": {"degree": (10, 3)}, "degree word": {"degree": "33"},
    "knots short": {"knots": ([0, 1], None)},
    "knots fall": {"knots": ([0, 0, 0, 0, 2, 1, 3, 3, 3, 3], None)},
    "knots all one": {"knots": (None, [1] * 11)}, "knots NaN": {"knots": (None, [NAN] * 11)},
    "knots apart": {"degree": (3, 2), "knots": (None, [0, 0, 0, 1, 1, 1, 1.5, 2, 2, 2])},
    "knots too close": {"knots": ([0, 0, 0, 0, 1e-300, 1, 2, 2, 2, 2], None)},
    "knots not two": {"knots": [0, 0, 1, 1]}, "knots a word": {"knots": "xy"},
    "weight 0": {"weights": np.zeros((6, 7))},
    "weights apart": {"weights": np.diag([1e9] * 7)[:6] + 1},
    "weights wrong": {"weights": np.ones((7, 6))}, "weights ragged": {"weights": [[1, 2], [3]]},
    "u beyond": {"u": (0.5, 1.5)}, "v reversed": {"v": (0.5, 0.2)}, "v a word": {"v": "all"},
    "one point": {"points": np.ones((4, 4, 3))}, "on a line": {"points": hood() * [1, 0, 0]},
    "a pole": {"points": POLE}, "folded": {"points": folded()},
    "kinked": {"points": RIDGE, "degree": (2, 1), "knots": ([0, 0, 0, 1, 1, 2, 2, 2], None)},
    "kinked facets": {"points": hood(), "degree": (1, 1)},
    "all": {"degree": (3, 3), "knots": ([3], [4]), "weights": -np.ones((6, 7)), "u": (1, 0),
            "side": "up", "position": 1},
}  # fmt: skip


def test_bad_nets(approved):
    lines = [f"{k}: {refused(bspline, **{'points': hood(), **bad})}" for k, bad in NETS.items()]
    approved("bad_nets", "\n".join(lines))
    assert np.isfinite(bspline(POLE, u=(0.05, 1.0)).cells(3, 3).areas).all()  # a pole left out


FLAT = sampled(lambda u, v: (u, v, 0.0 * u), (0, 1), (0, 2), (4, 5))
UP = [[0, 0, 1]]
UNIT = ((0, 1), (0, 1))
OTHERS = {
    "no function": lambda: parametric(5, (1, 0), (0, NAN)),
    "a pole": lambda: parametric(ball, *UNIT),
    "tuples": lambda: parametric(lambda u, v: (u, v), *UNIT),
    "shapes": lambda: parametric(lambda u, v: np.zeros((2, 2)), *UNIT),
    "a fault within": lambda: parametric(lambda u, v: {}["u"], *UNIT),
    "one argument": lambda: parametric(lambda u: u, *UNIT),
    "infinite": lambda: parametric(lambda u, v: (u, v, np.log(u)), (-1, 1), (0, 1)),
    "a crease": lambda: parametric(lambda u, v: (u, v, abs(u - 0.3)), *UNIT),
    "a step": lambda: parametric(lambda u, v: (u, v, np.sign(u)), (-1, 1), (0, 1)),
    "a line": lambda: parametric(lambda u, v: (u + v, 0 * u, 0.0), *UNIT),
    "a point": lambda: parametric(lambda u, v: (0.0, 0.0, 0.0), *UNIT),
    "kilometres": lambda: parametric(lambda u, v: (1e9 * u, v, 0.0), *UNIT),
    "grid of one row": lambda: grid(FLAT[:1]),
    "grid of pairs": lambda: grid(FLAT[..., :2]),
    "ragged grid": lambda: grid([[[0, 0, 0]], [[0, 0, 0], [1, 1, 1]]]),
    "grid with NaN": lambda: grid(np.where(FLAT[1, 2] == FLAT, NAN, FLAT)),
    "grid with a point twice": lambda: grid(FLAT[:, [0, 1, 1, 3]]),
    "grid with a pole": lambda: grid(np.concatenate([FLAT[:3], np.tile(FLAT[3:, :1], (1, 5, 1))])),
    "folded grid": lambda: grid(FLAT[[0, 2, 1, 3]]),
    "no pieces": lambda: piecewise([]),
    "pieces None": lambda: piecewise(None),
    "one patch": lambda: piecewise(plane(*UNIT)),
    "no patches": lambda: piecewise([3, plane(*UNIT), "x"], side=np.array([1, 2])),
    "gap below 0": lambda: piecewise([plane(*UNIT)], gap=-1, position=(1, 2)),
    "gap too wide": lambda: piecewise([plane(*UNIT)], gap=0.1),
    "many pieces": lambda: piecewise([plane(*UNIT)] * 201),
    "three on a seam": lambda: piecewise(
        [plane(*UNIT), *(plane((-1, 0), (0, 1), rpy_deg=(0, a, 0)) for a in (40, 90))]),
    "overlapping": lambda: piecewise([plane(ends, (0, 1)) for ends in ((0, 1), (1, 2), (1.9, 3))]),
    **{f"cells {shape}": lambda shape=shape: piecewise([plane(*UNIT)] * 1).cells(shape)
       for shape in (3, "ab", (1, 2, 3), [(1, 2), (3, 4)], [(3,)], [(3, -1)], [(3, True)])},
    "one pose": lambda: poses([[0, 0, 0]], UP),
    "poses with NaN": lambda: poses([[0, 0, 0], [0, 0, NAN]], UP * 2),
    "poses that turn back": lambda: poses([[0, 0, 0], [0, 0, 1]], [[0, 0, 1], [0, 0, -1]]),
    "more normals": lambda: poses([[0, 0, 0], [0, 0, 1]], UP * 3),
    "tangents along": lambda: poses([[0, 0, 0], [0, 0, 1]], UP * 2, None, UP * 2),
    "crowd": lambda: poses(np.random.default_rng(0).random((200, 3)), np.ones((200, 3)),
                           neighbours=2.0),
    "all of poses": lambda: poses([[0, 0, 0], [0, 0, 1]], [[0, 0, 1], [0, 0, 0]],
                                  tangents=[[1, 0, 0]], neighbours=-1),
}  # fmt: skip


def test_bad_formulas_grids_pieces_and_poses(approved):
    approved("bad_others", "\n".join(f"{name}: {refused(make)}" for name, make in OTHERS.items()))


NET = "row,column,x,y,z\n"
TABLE = NET + "".join(f"{i},{j},{i},{j},0\n" for i in range(4) for j in range(5))
GRIDS = {  # nets and poses: tests/input/bad; what is no file: tests/input/test_any_bytes.py
    "a.txt": "", "a.npy": "", "flat.npy": npy(np.zeros((3, 3))),
    "object.npy": npy(np.array([{}], dtype=object), True),
    "pairs.npy": npy(np.zeros((3, 3, 2))), "header.csv": "x,y\n1,2\n",
    "complex.npy": npy(np.zeros((2, 2, 3), dtype=complex)),
    "cut.npy": npy(np.zeros((2, 2, 3)))[:-8], "hole.csv": TABLE.replace("1,1,", "1,9,", 1),
}  # fmt: skip


def test_bad_grid_files(approved, tmp_path):
    lines = []
    for name, content in GRIDS.items():
        (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        words = refused(coverable.read_grid, tmp_path / name)
        assert str(tmp_path) not in words
        assert len(words) < 300
        lines.append(f"{name!r}: {words}")
    approved("bad_grid_files", "\n".join(lines))


def test_a_net_comes_back_from_files_to_the_last_digit(tmp_path):
    knots = [[0, 0, 0, 0, 0.2, 0.7, 1, 1, 1, 1], [0, 0, 0, 0, 1, 2, 3, 4, 4, 4, 4]]
    net = {"points": hood().tolist(), "knots": knots, "weights": WEIGHTS.tolist(), "degree": [3, 3]}
    (tmp_path / "hood.json").write_text(json.dumps(net), encoding="utf-8-sig")
    read = bspline(**coverable.read_net(str(tmp_path / "hood.json"))._asdict(), side="outside")
    assert (read.net.points == hood()).all()
    assert (read.net.weights == WEIGHTS).all()
    assert same_surface(read, bspline(hood(), (3, 3), knots, WEIGHTS, side="outside"))
    rows = [[i, j, *hood()[i, j], WEIGHTS[i, j]] for i in range(6) for j in range(7)]
    with open(tmp_path / "hood.CSV", "w", newline="") as stream:
        csv.writer(stream).writerows([[*NET.strip().split(","), "weight"]])
        csv.writer(stream).writerows([rows[k] for k in np.random.default_rng(3).permutation(42)])
        stream.write("\n\n")
    read = coverable.read_net(tmp_path / "hood.CSV")
    assert (np.array(read.points) == hood()).all()
    assert (np.array(read.weights) == WEIGHTS).all()


def test_grids_come_back_from_files_in_their_units(tmp_path):
    points = sampled(ball, (0.3, 1.0), (0, 1), (4, 5))
    np.save(tmp_path / "dome.npy", 1e3 * points)
    (tmp_path / "dome.csv").write_bytes(net_csv((1e3 * points).tolist()))
    for name in ("dome.npy", "dome.csv"):
        np.testing.assert_allclose(coverable.read_grid(tmp_path / name, "mm"), points, atol=1e-15)
    assert coverable.read_grid(tmp_path / "dome.npy").max() > 100.0
