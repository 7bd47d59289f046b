"""Commands, each run once: their words and the outlines of their pages are approved, their bounds
hold, and the numbers of `--json` are, key by key, what Python answers to the same question."""

import difflib
import html
import itertools
import json
import math
import re
import shlex
from types import SimpleNamespace

import json_of
import numpy as np
import pytest
from approved import NUMBER
from command_table import COMMANDS, NEEDS, NUMBERS, REFUSED, TABLE, WHOLE
from page_outline import Page, fetched

import coverable
from coverable import check, load_case, load_motion, open_workers, pass_runs, trajectory, verify
from feasibility.cli.main import parser_of
from feasibility.collisions.words import UNCHECKED
from feasibility.demands.area import treated_by_walk
from feasibility.demands.motion_rates import path_rates
from feasibility.division.between_patches import ends_of
from feasibility.placement.trials import evaluator_of_study
from feasibility.timing.speed_limits import used
from feasibility.verdict import Walk
from feasibility.version import version

CHOICES = re.compile(r"\(choose from .*?\)")  # each version of Python has other quotes
STATUS = ("zero", "one", "two", "three")


def unwrapped(text):
    """Lines that were broken at 100 columns in one: where that is depends on the numbers."""
    lines = text.splitlines()
    found = lines[:1]
    for before, line in itertools.pairwise(lines):
        first = re.match(r" *(\S+(?: (?:deg|mm|m2|m/s|m|s|%)(?!\w))?)", line)
        indent, same = (len(each) - len(each.lstrip()) for each in (line, before))
        broken = first and len(before) + 1 + len(first[1]) > 100 >= len(before)
        if broken and (indent >= 10 or indent == same):
            found[-1] += f" {line.strip()}"
        else:
            found.append(line)
    return "\n".join(re.sub(r"(?<=\S) {2,}", "  ", line) for line in found if line)


def transcript(line, said):
    parts = [f"$ coverable {line}".rstrip() + f"  -> {STATUS[said.status]}"]
    parts += [unwrapped(said.out.rstrip())] if said.out else []
    parts += ["-- stderr", unwrapped(said.err.rstrip())] if said.err else []
    return "\n".join(parts)


def beside(text, other, name):
    """A text, but for two and more lines at a time that the one called `name` has too."""
    lines, shown, at = text.splitlines(), [], 0
    same = difflib.SequenceMatcher(None, other.splitlines(), lines, autojunk=False)
    for _, first, count in same.get_matching_blocks():
        end = first + count
        shown += lines[at:first] + ([f"... as {name}"] if count > 1 else lines[first:end])
        at = end
    return "\n".join(shown)


def masked(text, commands):
    """Without the folder, and without what each version of Python writes in its own way."""
    return CHOICES.sub("(choose from ...)", text).replace(str(commands.folder), "FOLDER")


@pytest.mark.parametrize(("command", "name"), COMMANDS)
def test_what_a_command_says(commands, approved, command, name):
    def said(name):
        text = transcript(f"{command} {TABLE[command][name]}", commands.run(command, name))
        return NUMBER.sub("#", approved.masked(masked(text, commands)))

    others = [one for one in WHOLE.get(command, ()) if name not in WHOLE[command]]
    texts = [said(name), *(beside(said(name), said(one), one) for one in others)]
    approved(f"{command}/{name}", min(texts, key=lambda text: text.count("\n")))


PAGES = [(command, name) for command, name in COMMANDS if "--html" in TABLE[command][name]]
ALIKE = ("path", "infeasible"), ("check", "no motion to write")  # as within that of `explain`
PAGES = [one for one in PAGES if one[0] != "show" and one not in ALIKE]


@pytest.mark.parametrize(("command", "name"), PAGES)
def test_the_outline_of_a_page(commands, approved, command, name):
    text = commands.page(command, name)
    assert fetched(text) == []
    assert len(text) < 2_000_000
    page = Page(text)
    assert UNCHECKED in html.unescape(text).lower(), "every page says what is not checked"
    if command == "check":
        program = page.block("program").decode()
        assert set(re.findall(r"https?://[\w./]+", program)) <= {"http://www.w3.org/1999/xhtml"}
    outline = re.sub(r"\d+ evalu", "# evalu", page.outline()).replace(version(), "VERSION")
    approved(f"pages/{command} {name}", outline)


def test_a_result_is_shown_as_it_was_when_it_was_found(commands):
    assert commands.page("show", "a page") == commands.page("check", "files")
    missed = "cells out of reach", "no motion to write"
    assert commands.page("show", missed[0]) == commands.page("check", missed[1])


@pytest.mark.parametrize("command", REFUSED)
def test_what_is_refused_is_one_message_on_stderr_and_status_2(commands, approved, command):
    for needed in NEEDS.values():
        commands.run(*needed)
    texts = []
    for line in REFUSED[command]:
        line = line if command == "coverable" else f"{command} {line}"
        before = {file.name for file in commands.folder.iterdir()}
        said = commands.say(shlex.split(line))
        assert (said.status, said.out) == (2, ""), line
        assert said.err.count("coverable: ") <= 1
        assert "bug" not in said.err
        assert {file.name for file in commands.folder.iterdir()} == before, "no file is written"
        texts.append(f"$ coverable {line}  -> {masked(said.err.rstrip(), commands)}")
    approved(f"refused/{command}", "\n".join(texts))


def test_the_flags_of_every_command(commands, approved):
    (choices,) = (action for action in parser_of()._actions if action.choices)
    assert set(choices.choices) == {*TABLE, "robots", "keys", "live", "warm-up"}
    lines = []
    for command in ("", *choices.choices):
        said = commands.say([*command.split(), "--help"])
        assert (said.status, said.err) == (0, "")
        own = [line for line in said.out.splitlines() if re.match(r"  -", line)]
        flags = [word for line in own for word in re.findall(r"--[\w-]+", line)[:1]]
        lines.append(f"{command or 'coverable'}: {' '.join(flags)}")
        if "exit status" in said.out:
            text = " ".join(said.out[said.out.index("exit status") :].split())
            lines.append(f"    {text}")
    approved("flags", "\n".join(lines))


LEAST = {
    r"bodies at least (\S+) mm apart": lambda one: 1e3 * one["min_clearance_m"],
    r"joints at least (\S+) deg from": lambda one: one["min_limit_margin_deg"],
    r"singular values of at least (\S+) ": lambda one: one.get("min_singular_value"),
    r"tool speeds up to (\S+) m/s": lambda one: one.get("max_speed_m_per_s"),
}

MOST = {
    r"tool point within (\S+) mm of": lambda one: 1e3 * one["max_position_error_m"],
    r"tool within (\S+) mm": lambda one: 1e3 * one["max_position_error_m"],
    r"axis within (\S+) deg": lambda one: one["max_angle_deg"],
    r"roll within (\S+) deg": lambda one: one["max_roll_deg"],
}

PRINTED = [(c, n) for c, n in COMMANDS if c in ("check", "path", "verify")]


@pytest.mark.parametrize(("command", "name"), PRINTED)
def test_bounds_that_are_printed_hold(commands, command, name):
    """A clearance as printed is never larger than the certified one, nor an error smaller."""
    text = " ".join(commands.run(command, name).out.split())
    found = commands.run(command, name, "--json").out
    certificate = json.loads(found).get("certificate") if found else None
    for patterns, holds in ((LEAST, lambda a, b: a <= b), (MOST, lambda a, b: a >= b)):
        for pattern, value in patterns.items():
            for printed in re.findall(pattern, text) if certificate else ():
                true = value(certificate)
                if true is None:  # of a path, which has it elsewhere
                    continue
                assert holds(float(printed), true), f"{pattern}: {printed}, {true}"
                assert float(printed) == pytest.approx(true, rel=0.011, abs=1e-12)


@pytest.mark.parametrize("name", [one for one in COMMANDS if one[0] not in ("show", "cases")])
def test_every_text_says_in_one_line_what_is_checked(commands, name):
    said = commands.run(*name)
    texts = [line for line in f"{said.out}\n{said.err}".splitlines() if "ollisions" in line]
    asked = [line for line in texts if UNCHECKED in line.lower() or "are checked with" in line]
    assert len(asked) == 1, texts
    clear = "scene" in TABLE[name[0]][name[1]] or "collision" in TABLE[name[0]][name[1]]
    assert (UNCHECKED in asked[0].lower()) == (not clear)


ASKED = [one for one in COMMANDS if one[0] not in ("show", "cases")]
ASKED += [(command, line) for command in NUMBERS for line in NUMBERS[command]]


@pytest.fixture(autouse=True)
def inside(commands, monkeypatch):
    """In the folder of the commands, without files that they are asked to write."""
    monkeypatch.chdir(commands.folder)


def of_check(args):
    setup, seeds = load_case(args.case, args.settings).build(), None
    if args.seeds:
        q = load_motion(args.seeds, setup.robot).q
        seeds = Walk(q, np.full(len(q), -1))
    return json_of.of_check(check(*setup, seeds=seeds), args.witness == "-")


def of_path(args):
    setup = load_case(args.case, args.settings).build()
    speed = args.speed or setup.task.speed or 0.1
    limits = coverable.motion_limits(setup.robot, speed, args.velocity, args.acceleration)
    timing = {"velocity": args.velocity, "acceleration": args.acceleration, "period": 0.02}
    along = passes = None
    if args.passes is None:
        verdict = check(*setup)
    else:
        angle = math.radians(float(args.passes))
        passes = coverable.parallel_passes(setup.cells.surface, args.pitch, angle)
        along = coverable.plan_passes(setup.robot, passes, setup.task, search=setup.search)
        verdict = along.verdict
    if along is not None and not verdict.feasible:
        found = pass_runs(setup.robot, along.cells, verdict.task, along.places, verdict.seed)
        timed = [trajectory(run, speed, **timing) for run in found.runs]
        treated = along.treated(*(run.walk for run in found.runs)) if found.runs else None
        asked = SimpleNamespace(along=along, found=found, timed=timed, treated=treated)
        return json_of.of_runs(asked)
    if not verdict.feasible:
        return json_of.of_check(verdict) | {"trajectory": None}
    path = coverable.coverage_path(verdict, args.order)
    treated = treated_by_walk(setup.robot, path.cells, setup.task, path.walk)
    if along is not None:
        treated = along.treated(path.walk)
    ends = None if args.approach is None else ends_of(path, args.approach)
    moves = {"entry": ends and ends.entry, "leave": ends and ends.exit}
    run = trajectory(path, speed, **moves, **timing)
    return json_of.of_path(SimpleNamespace(
        path=path, run=run, limits=limits, most=used(setup.robot, run, limits), passes=passes,
        treated=treated, rates=path_rates(path), ends=ends,
    ))  # fmt: skip


def of_place(args):
    case = load_case(args.case, args.settings)
    setup = case.build()
    held = coverable.Pose.of_values([*case.surface.position, *case.surface.rpy_deg])
    ranges = {"x": args.x} | ({} if args.yaw is None else {"yaw_deg": args.yaw})
    with open_workers(0) as workers:
        evaluator = evaluator_of_study(case, len(setup.cells), workers)
        count = {} if args.count is None else {"count": args.count}
        region = coverable.Region.around(held, ranges)
        found = coverable.place(*setup[:3], region, setup.search, evaluator=evaluator, **count)
        wanted = args.stations and found.answer != "feasible"
        plan = coverable.station_plan(found, evaluator, setup.search, **count) if wanted else None
    return json_of.of_place(SimpleNamespace(found=found, plan=plan))


def of_study(args):
    study = coverable.load_study(args.file)
    with open_workers(0) as workers:
        rows = coverable.run_tasks(study.tasks, workers)
    return json_of.of_study(SimpleNamespace(study=study, rows=rows))


def of_compare(args):
    with open_workers(0) as workers:
        case, arms = load_case(args.case, args.settings), args.robots.split(",")
        return json_of.of_compare(coverable.compare(case, arms, workers, args.critical))


def of_verify(args):
    if args.motion is None:
        return json_of.of_verify(verify(coverable.load_result(args.case)))
    setup = load_case(args.case, args.settings).build()
    motion = load_motion(args.motion, setup.robot)
    return json_of.of_verify(verify(*setup[:3], motion.q, marks=motion.marks))


def of_divide(args):
    return json_of.of_divide(coverable.divide(*load_case(args.case, args.settings).build()))


def of_explain(args):
    return json_of.of_explain(coverable.explain(*load_case(args.case, args.settings).build()))


@pytest.mark.parametrize(("command", "name"), ASKED)
def test_the_numbers_are_those_of_python(commands, command, name):
    if name in TABLE[command]:
        words, said = commands.words(command, name), commands.run(command, name, "--json")
    else:
        commands.run("check", "files")
        words = [command, *shlex.split(name)]
        said = commands.say([*words, "--json"])
    found = json.loads(said.out, parse_constant=pytest.fail)  # NaN and inf
    json_of.agree(found, globals()[f"of_{command}"](parser_of().parse_args(words)))
    word = found.get("verdict") or found.get("answer")
    known = {"feasible": 0, "complete": 0, "holds": 0, "infeasible": 1, "partial": 1,
             "does not hold": 1, "undecided": 3, None: 0}  # fmt: skip
    assert said.status == known[word]
