"""What an explanation costs beside a verdict, and what it finds; cases of 90 cells."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np
from paper_cases import PAPER_CASES

from feasibility import Evidence, Task, check
from feasibility.sensitivity import explain
from feasibility.sensitivity.quantities import Variant
from robots import load_robot
from surfaces import cylinder, plane, sphere
from surfaces.meshes import TriangleMesh, mesh

GRID = (9, 10)  # rows and columns of cells
SOME = 5  # verdicts in a row


def _paper(name: str) -> Variant:
    case = PAPER_CASES[name]
    return Variant(case.robot(), case.cells(), case.task())


def _plate(
    arm: str, x: tuple[float, float], half: float, z: float, cone: float = 30.0, **limits_deg: float
) -> Callable[[], Variant]:
    """A level plate before an arm, `half` of its width to either side; limits of some joints."""

    def setup() -> Variant:
        robot = load_robot(arm)
        robot = robot.with_limits({j: np.radians([-a, a]) for j, a in limits_deg.items()})
        patch = plane(x, (-half, half), "outside", (0.0, 0.0, z))
        return Variant(robot, patch.cells(*GRID), Task(0.02, cone))

    return setup


def _dome(arm: str, radius: float, x: float, z: float) -> Callable[[], Variant]:
    """A piece of a ball that looks at the arm."""

    def setup() -> Variant:
        patch = sphere(radius, (10, 50), (150, 230), position=(x, 0, z), side="outside")
        return Variant(load_robot(arm), patch.cells(*GRID), Task(0.02, 25))

    return setup


def _bowl() -> Variant:
    patch = sphere(0.25, (120, 170), (0, 360), position=(0.5, 0, 0.4), side="inside")
    return Variant(load_robot("ur5"), patch.cells(*GRID), Task(0.02, 40))


def _behind() -> Variant:
    """A piece of a wall behind the arm, which joint 1 may go around to."""
    robot = load_robot("ur5").with_limits({"shoulder_pan_joint": (0.0, 2.0 * np.pi)})
    patch = cylinder(0.6, (150, 210), (0.1, 0.5), side="inside")
    return Variant(robot, patch.cells(*GRID), Task(0.02, 30))


def _mesh() -> Variant:
    """A piece of a drum before a panda, as triangles."""
    patch = cylinder(0.3, (140, 220), (0.1, 0.4), position=(0.75, 0, 0.1))
    u, v = np.meshgrid(
        np.linspace(*patch.u_range, 50), np.linspace(*patch.v_range, 40), indexing="ij"
    )
    k = np.arange(u.size).reshape(u.shape)
    a, b, c, d = (side.ravel() for side in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    faces = np.vstack([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    drum = mesh(TriangleMesh(patch.point(u, v).reshape(-1, 3), faces), side="outside")
    return Variant(load_robot("panda"), drum.cells(count=90), Task(0.02, 30))


CASES: dict[str, Callable[[], Variant]] = {
    **{name: (lambda name=name: _paper(name)) for name in PAPER_CASES},  # type: ignore[misc]
    "ur5 plate": _plate("ur5", (0.3, 0.6), 0.15, 0.3),
    "ur5 plate, 1 deg": _plate("ur5", (0.3, 0.6), 0.15, 0.3, 1.0),
    "ur5 plate, half out": _plate("ur5", (0.6, 1.1), 0.15, 0.3),
    "ur5 plate, all out": _plate("ur5", (1.2, 1.5), 0.15, 0.3),
    "ur5 dome": _dome("ur5", 0.25, 0.6, 0.1),
    "ur5 bowl": _bowl,
    "ur5 wall behind": _behind,
    "ur10 plate": _plate("ur10", (0.4, 0.9), 0.25, 0.2),
    "ur10 dome": _dome("ur10", 0.4, 0.9, 0.0),
    "panda plate": _plate("panda", (0.35, 0.6), 0.15, 0.3),
    "panda plate, far": _plate("panda", (0.5, 0.85), 0.3, 0.2),
    "panda plate, half out": _plate("panda", (0.5, 1.0), 0.15, 0.3),
    "panda dome": _dome("panda", 0.25, 0.65, 0.1),
    "panda mesh drum": _mesh,
    "xarm7 plate": _plate("xarm7", (0.3, 0.55), 0.15, 0.2),
    "kinova plate": _plate("kinova", (0.3, 0.55), 0.15, 0.3),
    "z1 plate": _plate("z1", (0.25, 0.4), 0.1, 0.2),
}


def _median(table: list[dict[str, object]]) -> dict[str, object]:
    """What an explanation of the paper's cases costs in the middle, in verdicts; goal 15."""
    columns = ("ratio of FK (target 40)", "ratio of times (target 40)")
    paper = [row for row in table if row["case"] in PAPER_CASES]
    middle = {name: statistics.median(float(str(row[name])) for row in paper) for name in columns}
    return {**dict.fromkeys(table[0], ""), "case": "paper's, median (target 15)", **middle}


def rows(repeats: int = 3) -> tuple[str, list[dict[str, object]]]:
    """One row for each case: work and time of both, and how its thresholds ended."""
    table = []
    for name, make in CASES.items():
        setup = make()
        explanation = explain(*setup)  # loads kernels, and derives what is part of the cells
        verdict_s, explain_s = [], []
        for _ in range(repeats):
            began = time.process_time()
            for _ in range(SOME):
                verdict = check(*setup)
            between = time.process_time()
            explanation = explain(*setup)
            verdict_s.append((between - began) / SOME)
            explain_s.append(time.process_time() - between)
        cost = verdict.statistics["fk"]
        found = [t for t in explanation.thresholds if t.feasible is not None]
        sides = [t.other for t in explanation.thresholds if t.other is not None]
        proofs = [side for side in sides if side.evidence is Evidence.PROOF]
        apart = [t.steps_apart for t in found]
        verdict_ms, explain_ms = (1e3 * min(s) for s in (verdict_s, explain_s))
        table.append(
            {
                "case": name,
                "verdict": f"{verdict.answer} ({verdict.evidence})",
                "verdict FK": cost,
                "ratio of FK (target 40)": (explanation.evaluations + cost) / cost,
                "verdict ms": verdict_ms,
                "explain ms": explain_ms,
                "ratio of times (target 40)": explain_ms / verdict_ms,
                "feasible sides": f"{len(found)} of {len(explanation.thresholds)}",
                "other sides proved": f"{len(proofs)} of {len(sides)}",
                "more than 5 steps apart": sum(k > 5 for k in apart),
                "steps apart, worst": max(apart, default=0),
            }
        )
    table.append(_median(table))
    return (
        f"Explanations: what would make a case feasible; processor time, least of {repeats}.",
        table,
    )
