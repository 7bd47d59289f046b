"""Control nets from files: what is written comes back, and what is hostile is refused."""

import csv
import json
import os

import numpy as np
import pytest
from smooth_probes import same_surface
from spline_nets import hood

from surfaces import SurfaceError, bspline
from surfaces.patches.nurbs.control_net_file import MOST_BYTES, read_net

RNG = np.random.default_rng(3)
WEIGHTS = RNG.uniform(0.5, 2.0, (6, 7))
KNOTS = [[0, 0, 0, 0, 0.2, 0.7, 1, 1, 1, 1], [0, 0, 0, 0, 1, 2, 3, 4, 4, 4, 4]]


def write_csv(path, points, weights=None, order=None):
    rows = [
        [i, j, *map(repr, points[i, j].tolist()), *([] if weights is None else [weights[i, j]])]
        for i in range(points.shape[0])
        for j in range(points.shape[1])
    ]
    with open(path, "w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["row", "column", "x", "y", "z"] + ["weight"] * (weights is not None))
        writer.writerows(rows if order is None else [rows[k] for k in order])


def test_json_comes_back_to_the_last_digit(tmp_path):
    file = tmp_path / "hood.json"
    net = {"points": hood().tolist(), "knots": KNOTS, "weights": WEIGHTS.tolist(), "degree": [3, 3]}
    file.write_text(json.dumps(net))
    read = bspline(**read_net(file)._asdict(), side="outside")
    assert (read.net.points == hood()).all()
    assert (read.net.weights == WEIGHTS).all()
    assert same_surface(read, bspline(hood(), (3, 3), KNOTS, WEIGHTS, side="outside"))
    file.write_text(json.dumps({"points": hood().tolist()}), encoding="utf-8-sig")
    assert same_surface(bspline(**read_net(str(file))._asdict()), bspline(hood()))


def test_csv_comes_back_in_any_order_of_lines(tmp_path):
    file = tmp_path / "hood.CSV"
    write_csv(file, hood())
    assert same_surface(bspline(**read_net(file)._asdict()), bspline(hood()))
    write_csv(file, hood(), WEIGHTS, order=RNG.permutation(42))
    read = read_net(file)
    assert (np.array(read.points) == hood()).all()
    assert (np.array(read.weights) == WEIGHTS).all()
    file.write_text(file.read_text() + "\n\n")
    assert read_net(file) == read


LINES = "row,column,x,y,z\n"
HOSTILE = {
    "empty.json": (b"", "Expecting value"),
    "cut.json": (b'{"points": [[[0, 0', "Expecting"),
    "list.json": (b"[[0, 0, 0]]", "must hold one object"),
    "no_points.json": (b'{"degree": [3, 3]}', 'no key "points"'),
    "foreign.json": (b'{"points": [], "__class__": 1}', "not known: '__class__'"),
    "nan.json": (b'{"points": [[[NaN, 0, 0]]]}', "holds NaN; every number must be finite"),
    "infinite.json": (b'{"points": [[[-Infinity, 0, 0]]]}', "holds -Infinity"),
    "twice.json": (b'{"points": [], "points": []}', "a key twice"),
    "deep.json": (b'{"points": ' + b"[" * 200_000 + b"]" * 200_000 + b"}", "nested too deep"),
    "digits.json": (b'{"points": ' + b"9" * 5000 + b"}", "digits"),
    "binary.json": (bytes(range(256)), "is not text in UTF-8"),
    "large.json": (b" " * (MOST_BYTES + 1), "larger than 16 MB"),
    "net.npy": (b"\x93NUMPY", "must be a .json or a .csv file"),
    "net.pkl": (b"\x80\x04.", "must be a .json or a .csv file"),
    "empty.csv": (b"", "must begin with the header row,column,x,y,z"),
    "header.csv": (b"x,y,z\n1,2,3\n", "must begin with the header"),
    "few.csv": ((LINES + "0,0,1,2\n").encode(), "line 2 must hold 5 numbers, got 4"),
    "nan.csv": ((LINES + "0,0,1,2,nan\n").encode(), "line 2: 'nan' is not a finite number"),
    "words.csv": ((LINES + "0,0,1,2,=cmd()\n").encode(), "'=cmd\\(\\)' is not a finite number"),
    "minus.csv": ((LINES + "-1,0,1,2,3\n").encode(), "whole number >= 0, got '-1'"),
    "far.csv": ((LINES + "0,9999999,1,2,3\n").encode(), "got '9999999'"),
    "again.csv": ((LINES + "0,0,1,2,3\n" * 2).encode(), "line 3 gives the point of row 0"),
    "gap.csv": ((LINES + "999999,999999,1,2,3\n").encode(), "row 0, column 0 is missing"),
    "many.csv": (
        (LINES + "".join(f"{k},0,1,2,3\n" for k in range(40_001))).encode(),
        "more than 40,000 points",
    ),
    "quote.csv": ((LINES + '"0,0,1,2,3\n').encode(), "unexpected end of data"),
    "field.csv": ((LINES + "0,0,1,2," + "3" * 200_000 + "\n").encode(), "field larger than"),
}


@pytest.mark.parametrize("name", HOSTILE, ids=str)
def test_hostile_files_are_refused_with_the_reason(name, tmp_path):
    content, message = HOSTILE[name]
    file = tmp_path / name
    file.write_bytes(content)
    with pytest.raises(SurfaceError, match=message) as caught:
        read_net(file)
    assert str(caught.value).startswith(f"'{name}': ")
    assert str(tmp_path) not in str(caught.value)
    assert len(str(caught.value)) < 300


def test_what_is_no_regular_file_is_refused_without_waiting(tmp_path):
    os.mkfifo(tmp_path / "pipe.json")
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "zero.json").symlink_to("/dev/zero")
    for name in ("pipe.json", "folder.csv", "zero.json"):
        with pytest.raises(
            SurfaceError, match="is a folder" if name == "folder.csv" else "not a regular"
        ):
            read_net(tmp_path / name)
    with pytest.raises(SurfaceError, match="no such file"):
        read_net(tmp_path / "none.json")
    with pytest.raises(SurfaceError, match="null byte"):
        read_net("a\0b.json")


@pytest.mark.parametrize(
    ("net", "message"),
    [
        ({"points": [[[0, 0, 1e400]] * 4] * 4}, "holds Infinity|must be a finite number, got inf"),
        ({"points": [[[0, 0, 10**400]] * 4] * 4}, "must be a finite number"),
        ({"points": [[[0, 0]] * 4] * 4}, "got the shape 4 x 4 x 2"),
        ({"points": {"0": 1}}, "points must be a list, got dict"),
        ({"points": hood().tolist(), "degree": "33"}, "degree must be two whole numbers"),
        ({"points": hood().tolist(), "knots": [1, 2, 3]}, "knots must be two lists"),
        ({"points": hood().tolist(), "weights": [[1, 2], [3]]}, "rows of one length"),
    ],
)
def test_what_a_file_says_is_checked_like_any_argument(net, message, tmp_path):
    file = tmp_path / "net.json"
    file.write_text(json.dumps(net))
    with pytest.raises(SurfaceError, match=message):
        bspline(**read_net(file)._asdict())
