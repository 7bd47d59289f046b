"""The numbers of `--json`, key by key, against what Python answers to the same question."""

from __future__ import annotations

import json
import math
import shlex
from types import SimpleNamespace

import numpy as np
import pytest
import schema
from command_table import COMMANDS, NUMBERS, TABLE
from schema import conforms

from feasibility import check, verify
from feasibility.cases import load_case
from feasibility.cli.main import _parser
from feasibility.division import divide
from feasibility.entry import ends_of
from feasibility.paths import coverage_path
from feasibility.placement import Pose, Region, StudyEvaluator, place, station_plan
from feasibility.results import load_motion, load_result
from feasibility.runs import pass_runs, plan_passes
from feasibility.sensitivity import explain
from feasibility.speed import path_rates
from feasibility.studies import compare, load_study, open_workers, run_tasks
from feasibility.timing import motion_limits, trajectory, used
from feasibility.treated import treated_by_walk
from feasibility.verdict import Walk
from surfaces.passes import parallel_passes

ASKED = [one for one in COMMANDS if one[0] not in ("show", "cases")]
ASKED += [(command, line) for command in NUMBERS for line in NUMBERS[command]]


@pytest.fixture(autouse=True)
def inside(commands, monkeypatch):
    """In the folder of the commands, without files that they are asked to write."""
    monkeypatch.chdir(commands.folder)


def of_check(args):
    case = load_case(args.case, args.settings)
    setup, seeds = case.build(), None
    if args.seeds:
        q = load_motion(args.seeds, setup.robot).q
        seeds = Walk(q, np.full(len(q), -1))
    found = check(*setup, seeds=seeds)
    given = {} if args.witness != "-" else {"witness": schema.of(lambda one: one, schema.WITNESS)}
    return SimpleNamespace(**_fields(found)), {**schema.CHECK, **given}


def _fields(one):
    """A verdict's fields; those that are made late, too."""
    names = ("answer", "evidence", "cells", "covered", "graph", "causes", "certificate", "task",
             "unchecked_links", "pairs_left_out", "proof", "treated", "robot", "method", "seed",
             "witness")  # fmt: skip
    return {name: getattr(one, name) for name in names}


def of_path(args):
    setup = load_case(args.case, args.settings).build()
    speed = args.speed or setup.task.speed or 0.1
    limits = motion_limits(setup.robot, speed, args.velocity, args.acceleration)
    timing = {"velocity": args.velocity, "acceleration": args.acceleration}
    along = passes = None
    if args.passes is None:
        verdict = check(*setup)
    else:
        angle = math.radians(float(args.passes))
        passes = parallel_passes(setup.cells.surface, args.pitch, angle)
        along = plan_passes(setup.robot, passes, setup.task, search=setup.search)
        verdict = along.verdict
    if along is not None and not verdict.feasible:
        found = pass_runs(
            setup.robot, along.cells, verdict.task, along.places, verdict.seed, proof=verdict.proof
        )
        timed = [trajectory(run, speed, period=0.02, **timing) for run in found.runs]
        treated = along.treated(*(run.walk for run in found.runs)) if found.runs else None
        return SimpleNamespace(along=along, found=found, timed=timed, treated=treated), schema.RUNS
    if not verdict.feasible:
        return SimpleNamespace(**_fields(verdict)), schema.NO_PATH
    path = coverage_path(verdict, args.order)
    treated = treated_by_walk(setup.robot, path.cells, setup.task, path.walk)
    if along is not None:
        treated = along.treated(path.walk)
    run = trajectory(path, speed, period=0.02, **timing)
    ends = None if args.approach is None else ends_of(path, args.approach)
    if ends is not None:
        from feasibility.entry import entered

        run = entered(path, run, ends, limits, 0.02)
    return SimpleNamespace(
        path=path, run=run, limits=limits, most=used(setup.robot, run, limits), passes=passes,
        treated=treated, rates=path_rates(path), ends=ends,
    ), schema.PATH  # fmt: skip


def of_place(args):
    case = load_case(args.case, args.settings)
    setup = case.build()
    held = Pose.of_values([*case.surface.position, *case.surface.rpy_deg])
    ranges = {"x": args.x} | ({} if args.yaw is None else {"yaw_deg": args.yaw})
    with open_workers(0) as workers:
        evaluator = StudyEvaluator(case, workers, None, lambda *_: None)
        count = {} if args.count is None else {"count": args.count}
        region = Region.around(held, ranges)
        found = place(*setup[:3], region, setup.search, evaluator=evaluator, **count)
        wanted = args.stations and found.answer != "feasible"
        plan = station_plan(found, evaluator, setup.search, **count) if wanted else None
    return SimpleNamespace(found=found, plan=plan), schema.PLACE


def of_study(args):
    study = load_study(args.file)
    with open_workers(0) as workers:
        return SimpleNamespace(study=study, rows=run_tasks(study.tasks, workers)), schema.STUDY


def of_compare(args):
    with open_workers(0) as workers:
        case, arms = load_case(args.case, args.settings), args.robots.split(",")
        return compare(case, arms, workers, critical=args.critical), schema.COMPARE


def of_verify(args):
    if args.motion is None:
        return verify(load_result(args.case)), schema.VERIFY
    setup = load_case(args.case, args.settings).build()
    motion = load_motion(args.motion, setup.robot)
    return verify(*setup[:3], motion.q, marks=motion.marks), schema.VERIFY


PYTHON = {
    "check": of_check, "path": of_path, "place": of_place, "study": of_study,
    "compare": of_compare, "verify": of_verify,
    "divide": lambda args: (divide(*load_case(args.case, args.settings).build()), schema.DIVIDE),
    "explain": lambda args: (explain(*load_case(args.case, args.settings).build()), schema.EXPLAIN),
}  # fmt: skip


def refuse(word):
    raise AssertionError(f"{word} in JSON")


@pytest.mark.parametrize(("command", "name"), ASKED)
def test_the_numbers_are_those_of_python(commands, command, name):
    if name in TABLE[command]:
        words, said = commands.words(command, name), commands.run(command, name, "--json")
    else:
        commands.run("check", "files")
        words = [command, *shlex.split(name)]
        said = commands.say([*words, "--json"])
    found = json.loads(said.out, parse_constant=refuse)
    source, wanted = PYTHON[command](_parser().parse_args(words))
    conforms(found, wanted, source)
    word = found.get("verdict") or found.get("answer")
    known = {"feasible": 0, "complete": 0, "holds": 0, "infeasible": 1, "partial": 1,
             "does not hold": 1, "undecided": 3, None: 0}  # fmt: skip
    assert said.status == known[word]
