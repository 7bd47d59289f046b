"""A large standoff over a concave detail: folds are named, and a smoothed copy is decided."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from mesh_patches import bent
from mesh_writers import stl
from plain import tools
from referee import Facets, evenly

from coverable import ArgumentError, Case, CaseError, check, load_case, load_result, mesh, verify
from feasibility.cli.main import main
from surfaces.meshes.smoothing import smoothed

STANDOFF = 0.2
TOML = """
robot.name = "ur10"
surface = { kind = "mesh", file = "panel.stl", position = [0.5, -0.2, -0.1], side = "outside", \
cells = 20 }
task = { standoff = 0.2, cone_deg = 40 }
"""


def bead(u, v):
    """A panel with a bead 8 mm high, flanks of 25 degrees, which no crease is."""
    x = 0.4 * u
    return x, 0.4 * v, 0.008 * np.clip((0.032 - abs(x - 0.2)) / 0.017, 0.0, 1.0)


@pytest.fixture
def panel(tmp_path):
    (tmp_path / "panel.stl").write_bytes(stl(*bent(bead, 60, 40)))
    path = tmp_path / "panel.toml"
    path.write_text(TOML)
    return path


def distances(setup, q) -> np.ndarray:
    """(k,) m, of the tool point from the triangles as given, at many places of a motion."""
    points, _ = tools(setup.robot, evenly(q, 5))
    vertices, faces = bent(bead, 60, 40)
    return Facets(vertices + setup.cells.surface.position, faces, True).distance(points)


def test_folds_are_named_with_a_length_that_does(panel, capsys) -> None:
    """Over more than the tolerance it is said, and the tool keeps that much more distance."""
    assert main(["check", str(panel), "--json"]) == 3
    message = json.loads(capsys.readouterr().out)["message"]
    assert "offset surface folds" in message
    assert "more than the tolerance" in message
    offered = re.search(r"With task\.smooth = ([0-9.]+)", message)
    again = [str(panel), "--set", f"task.smooth={offered[1]}"]
    assert main(["check", *again, "--json", "--save", str(panel.with_suffix(".zip"))]) == 0
    captured = capsys.readouterr()
    found = json.loads(captured.out)
    smooth = found["smooth"]
    assert smooth["length_m"] == float(offered[1])
    assert not smooth["taken_off_tolerance"]
    assert f"{1e3 * smooth['off_m']:.3g} mm off the surface" in captured.err
    result = load_result(panel.with_suffix(".zip"))
    assert verify(result).holds
    slack = found["certificate"]["max_position_error_m"] + smooth["off_m"]
    off = abs(distances(result.case.build(), result.verdict.witness.q) - STANDOFF)
    assert 1e-3 < off.max() <= slack + 1e-9
    # Neither the surface itself, nor a copy that is off by less, accepts this motion.
    case = replace(result.case, task=replace(result.case.task, smooth=None))
    assert not verify(*case.build()[:3], result.verdict.witness.q).holds


def test_what_a_copy_is_off_is_taken_off_the_tolerance(panel) -> None:
    """So the tool point keeps the standoff from the surface itself, within all of the tolerance."""
    settings = ["task.smooth=0.3", "task.tolerance=0.008"]
    with pytest.raises(CaseError, match=r"task\.smooth: smoothing over 1e-05 m needs more than"):
        load_case(panel, [*settings, "task.smooth=1e-5"]).build()
    case = Case.from_toml(TOML, panel.parent, overrides=settings)
    setup = case.build()
    verdict = check(*setup)
    off = setup.cells.surface.smoothing.off
    assert verdict.feasible
    for other in (0.2, None):
        with pytest.raises(ArgumentError, match=f"is {other}, but .* smoothed over 0.3 m"):
            check(*setup._replace(task=replace(setup.task, smooth=other)))
    assert 1e-3 < off < 0.008
    assert verdict.certificate.max_position_error <= 0.008 - off
    assert abs(distances(setup, verdict.witness.q) - STANDOFF).max() <= 0.008
    # Away from the copy by more than what is left the same motion is refused.
    lower = mesh(panel.with_suffix(".stl"), position=[0.5, -0.2, -0.1075])
    assert not verify(
        setup.robot, smoothed(lower, 0.3, 0.008).cells(20), setup.task, verdict.witness.q
    ).holds
