"""Every reader of files that anybody may have written: a good file, and what must hold of any read.

Whatever the bytes are, it raises one `CoverableError` with its faults, or gives a value that is
sound: finite, in range, and the same when it is written and read again.
"""

import contextlib
import fnmatch
import io
import json
import tempfile
import warnings
import zipfile
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import bad_input
import hostile_visuals as hostile
import numpy as np
import pinocchio as pin
from jobs import case_named, verdict_named
from mesh_writers import GOOD

import coverable
from coverable import Evidence, load_motion, load_result, read_net, read_poses, save_result
from coverable.errors import CoverableError
from coverable.files import read_regular
from coverable.meshes.collada import read_collada
from coverable.meshes.collada_child import answer
from coverable.meshes.raw_mesh import MeshError
from coverable.meshes.robot_files import MeshFiles, largest_file
from coverable.processes import Ended
from feasibility.cut_tree import Cut, CutTree, Leaf
from robots.pinocchio_model import chain_model
from robots.urdf.checked_urdf import CheckedUrdf, check_urdf
from robots.urdf.srdf import read_srdf
from robots.urdf.xacro_files import expanded
from surfaces.meshes.sources import read_mesh

SRDF = (
    '<robot name="r"><disable_collisions link1="a" link2="b" reason="Adjacent"/>'
    '<disable_collisions link1="b" link2="c" reason="Never"/></robot>'
)
XACRO = (
    '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:arg name="a" default="1"/>'
    '<xacro:macro name="m" params="k"><link name="l${2 * k}"/></xacro:macro><xacro:m k="$(arg a)"/>'
    "</robot>"
)
STUDY = 'base.case = "paper/4a"\nvary."task.cone_deg" = [30, 45]\n'
TREE = CutTree(Cut(2, -1.43, Cut(3, 0.25, Leaf(3), Leaf(0)), Leaf(7)), ((5, 3.1),))
"""Proves nothing; whether it does is not asked of a reader."""


GRID = np.stack(np.broadcast_arrays([[0.0], [0.1], [0.2]], [[0.0, 0.1, 0.2]], 0.01), axis=2)


class Reader(NamedTuple):
    file: str
    """A name that it may have."""
    read: Callable[[Path], Any]
    good: Callable[[], bytes]
    sound: Callable[[Any, Path], None]
    """Fails where a value that was read is none; may write into a folder."""


def sound_case(case: coverable.Case, folder: Path) -> None:
    assert coverable.Case.from_toml(case.to_toml()) == case
    assert case.with_overrides([]) == case
    with contextlib.suppress(CoverableError):  # whatever its numbers are, or a sentence
        case.build()


def sound_urdf(checked: CheckedUrdf, _: Path) -> None:
    """The model holds the robot that is described, and no other."""
    moving = [info for info in checked.joints if info.moves]
    model = chain_model(checked, [info.name for info in moving], {})
    assert sorted(list(model.names)[1:]) == sorted(info.name for info in moving)
    assert model.nq == len(moving)
    for info in moving:
        assert (
            (info.fault is None) == (info.lower is not None)
            or info.mimic
            or "mimic" in (info.fault or "")
        )
        assert info.lower is None or info.upper > info.lower
        assert np.isclose(np.linalg.norm(info.axis), 1.0, rtol=0, atol=1e-14)
    placements = link_placements(model, {info.name: 0.3 for info in moving})
    assert set(placements) == set(checked.links)
    for placement in placements.values():
        rotation = placement[:3, :3]
        assert np.abs(rotation.T @ rotation - np.eye(3)).max() < 1e-12
        assert np.linalg.det(rotation) > 0


def link_placements(model: pin.Model, values: dict[str, float]) -> dict[str, np.ndarray]:
    """(4, 4) of every link in the root frame, with each joint at its value by name."""
    q = pin.neutral(model)
    for name, entry in zip(list(model.names)[1:], list(model.joints)[1:], strict=True):
        value = values[name]
        turned = [value] if entry.nq == 1 else [np.cos(value), np.sin(value)]
        q[entry.idx_q : entry.idx_q + entry.nq] = turned
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return {
        frame.name: data.oMf[i].homogeneous
        for i, frame in enumerate(model.frames)
        if frame.type == pin.FrameType.BODY
    }


def sound_net(net: Any, folder: Path) -> None:
    kept = {key: value for key, value in net._asdict().items() if value is not None}
    (folder / "again.json").write_text(json.dumps(kept))
    assert read_net(folder / "again.json")._replace(degree=net.degree) == net
    made_or_refused(lambda: coverable.bspline(**net._asdict()))


def made_or_refused(make: Callable[[], Any]) -> None:
    """A surface of finite cells, or a sentence."""
    try:
        made = make()
    except coverable.SurfaceError as error:
        assert error.faults  # noqa: PT017 - both outcomes are right
        return
    centres = made.centres if hasattr(made, "centres") else made.cells(2, 2).centres
    assert np.isfinite(centres).all()


def sound_grid(points: Any, _: Path) -> None:
    made_or_refused(lambda: coverable.grid(points))


def sound_poses(given: Any, _: Path) -> None:
    made_or_refused(lambda: coverable.poses(**given._asdict()))


def read_alone(*_: object) -> None:
    """That it is read is all."""


def parts_of(path: Path) -> Any:
    return MeshFiles().parts(str(path))


def collada_parts(path: Path) -> Any:
    """Without a process for each file: what that does is done here."""
    try:
        data = read_regular(path, largest_file(path), "a mesh of a robot")
        (found,) = read_collada([data], lambda *_: Ended(answer(data, 1000)))
        if isinstance(found, MeshError):
            raise found
    except CoverableError as fault:
        raise MeshError(f"{path.name}: {fault}") from fault
    return found


def sound_mesh(mesh: Any, _: Path) -> None:
    assert np.isfinite(mesh.vertices).all()
    assert sorted(set(mesh.faces.ravel().tolist())) == list(range(len(mesh.vertices)))
    assert (mesh.face_areas > 0).all()


def sound_parts(parts: Any, _: Path) -> None:
    for part in parts:
        assert 0 <= part.faces.min() <= part.faces.max() < len(part.vertices)


def sound_result(result: Any, folder: Path) -> None:
    path = save_result(result.verdict, result.case, folder / "again")
    after = load_result(path)
    assert (after.case, repr(after.verdict)) == (result.case, repr(result.verdict))
    assert save_result(after.verdict, after.case, folder / "more").read_bytes() == path.read_bytes()


def sound_trajectory(run: Any, folder: Path) -> None:
    assert np.isfinite(run.q).all()
    assert (np.diff(run.time) > 0.0).all()
    again = coverable.load_trajectory(coverable.save_trajectory(folder / "again.csv", run))
    assert again.joint_names == run.joint_names
    for name in ("time", "q", "dq", "ddq", "tool_speed", "cell"):
        assert np.array_equal(getattr(again, name), getattr(run, name))


def sound_motion(motion: Any, folder: Path) -> None:
    assert motion.q.shape[1] == 6
    assert np.isfinite(motion.q).all()
    rows = [",".join(map(repr, row)) for row in motion.q.tolist()]
    (folder / "again.csv").write_text("\n".join([",".join(PUMA.joint_names), *rows]))
    assert np.array_equal(load_motion(folder / "again.csv", PUMA).q, motion.q)


def sound_srdf(pairs: Any, _: Path) -> None:
    assert all(link.strip() for link in pairs.named)
    assert {link for pair in pairs.taken for link in pair} <= pairs.named


@cache
def members(which: str) -> dict[str, bytes]:
    """What is in the result file of a small verdict: "plate", "proof" or "deep"."""
    verdict, case = verdict_named("plate"), case_named("plate")
    if which != "plate":
        tree, case = TREE, case_named("long plate")
        if which == "deep":
            node: Cut | Leaf = Leaf(0)
            for k in range(201):
                node = Cut(0, 0.01 * k, Leaf(1), node)
            tree = CutTree(node)
        verdict = replace(verdict_named("long plate"), proof=tree, evidence=Evidence.PROOF)
    with tempfile.TemporaryDirectory() as folder:
        saved = save_result(verdict, case, Path(folder) / "good")
        with zipfile.ZipFile(saved) as file:
            return {name: file.read(name) for name in file.namelist()}


def packed(content: dict[str, bytes], twice: str = "") -> bytes:
    """A zip of members, one of them perhaps twice."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name in (*content, *filter(None, [twice])):
            file.writestr(name, content[name])
    return stream.getvalue()


def npy(array: np.ndarray, pickled: bool = False) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=pickled)
    return stream.getvalue()


def damaged(which: str, change: dict[str, Any]) -> bytes:
    """A result file with one damage, as tests/input/bad/result.toml words it."""
    content = dict(members(which))
    for kind, value in change.items():
        if kind == "drop":
            del content[value]
        elif kind == "member":
            content[value[0]] = bad_input.many(value[1]).encode("latin-1")
        elif kind == "cut":
            content[value[0]] = content[value[0]][: value[1]]
        elif kind in ("meta", "without", "case"):
            content["meta.json"] = _other_meta(content["meta.json"], kind, value)
        elif kind in ("at", "rows", "columns", "objects", "floats"):
            pattern = f"{value if isinstance(value, str) else value[0]}.npy"
            for name in fnmatch.filter(content, pattern):
                content[name] = _other_array(np.load(io.BytesIO(content[name])), kind, value)
        elif kind == "fill":
            content |= {f"x{k}": b"" for k in range(value - len(content))}
    data = packed(content, change.get("twice", ""))
    if "claims" in change:  # in the headers of the zip, not in what is there
        name, size = change["claims"]
        claimed, there = (number.to_bytes(4, "little") for number in (size, len(content[name])))
        assert data.count(there) == 2
        return data.replace(there, claimed)
    return data


def _other_meta(text: bytes, kind: str, value: Any) -> bytes:
    meta = json.loads(text)
    if kind == "meta":
        meta |= value
    elif kind == "without":
        del meta[value]
    else:
        assert meta["case"]["toml"].count(value[0]) == 1
        meta["case"]["toml"] = meta["case"]["toml"].replace(*value)
    return json.dumps(meta).encode()


def _other_array(array: np.ndarray, kind: str, value: Any) -> bytes:
    if kind == "at":
        array[tuple(value[1])] = value[2]
    elif kind == "rows":
        array = array[: value[1]]
    elif kind == "columns":
        array = array[:, : value[1]]
    return npy(np.array([None, {}]) if kind == "objects" else array.astype(
        float if kind == "floats" else array.dtype), kind == "objects")  # fmt: skip


def of_bad(reader: str, name: str) -> bytes:
    one = bad_input.bad(reader)[name]
    return damaged(one.good, one.change) if isinstance(one.change, dict) else one.content


def _text(reader: str, name: str) -> Callable[[], bytes]:
    return lambda: bad_input.many(bad_input.goods(reader)[name].replace("§", "")).encode()


PUMA = coverable.load_robot("puma560")
CASES = "sphere", "revolution", "bspline", "piecewise", "scene", "mounted"
READERS = {
    **{f"case: {kind}": Reader("case.toml", coverable.load_case, _text("case", kind), sound_case)
       for kind in CASES},
    "study": Reader("study.toml", coverable.load_study, STUDY.encode, read_alone),
    "urdf": Reader("arm.urdf", check_urdf, _text("urdf", "arm"), sound_urdf),
    "xacro": Reader("arm.xacro", lambda path: expanded(str(path)), XACRO.encode, read_alone),
    "srdf": Reader("arm.srdf", read_srdf, SRDF.encode, sound_srdf),
    "net as JSON": Reader("net.json", read_net, _text("net", "json"), sound_net),
    "net as CSV": Reader("net.csv", read_net, bad_input.net_csv, sound_net),
    "grid": Reader("grid.npy", coverable.read_grid, lambda: npy(GRID), sound_grid),
    **{kind: Reader(file, lambda path: read_poses(path, "mm"), _text("poses", good), sound_poses)
       for kind, file, good in (("poses", "poses.csv", "csv"), ("noether", "a.yaml", "noether"),
                                ("cloud", "a.pcd", "cloud"))},
    **{file: Reader(file, lambda path: read_mesh(path, 1.0), lambda file=file: GOOD[file],
                    sound_mesh) for file in GOOD},
    "GLB of a robot": Reader("part.glb", parts_of, hostile.glb, sound_parts),
    "COLLADA": Reader("part.dae", collada_parts, hostile.GOOD.encode, sound_parts),
    "result": Reader("a.result", load_result, lambda: packed(members("plate")), sound_result),
    "proof": Reader("a.result", load_result, lambda: packed(members("proof")), sound_result),
    "trajectory as CSV": Reader("run.csv", coverable.load_trajectory, _text("trajectory", "csv"),
                                sound_trajectory),
    "motion": Reader("motion.csv", lambda path: load_motion(path, PUMA), _text("motion", "two"),
                     sound_motion),
}  # fmt: skip
