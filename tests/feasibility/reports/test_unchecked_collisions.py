"""Every answer, page and trajectory says that collisions are not checked."""

from __future__ import annotations

import html
import json
from pathlib import Path

import pytest
from path_cases import run_of
from small_cases import TEXTS, small_case, small_verdict

from feasibility.cli.main import main
from feasibility.collisions import UNCHECKED
from feasibility.results import load_motion
from feasibility.results.trajectory_files import as_csv, as_json_text, from_csv, from_json_text

SMALL = ("--set", "surface.cells=[2,2]")
PLACE = ("--x", "0", "0.1", "--count", "2", "--workers", "0")
COMMANDS = {
    "check, feasible": ("check", "plate.toml", *SMALL),
    "check, infeasible": ("check", "long plate.toml"),
    "check, undecided": ("check", "plate.toml", *SMALL, "--set", "task.cone_deg=0"),
    "check, greedy": ("check", "greedy dome.toml"),
    "path": ("path", "plate.toml", *SMALL, "--out", "run.yaml"),
    "path, none": ("path", "long plate.toml"),
    "divide": ("divide", "plate.toml", *SMALL),
    "divide, in part": ("divide", "long plate.toml"),
    "explain": ("explain", "plate.toml", *SMALL, "--set", "surface.cells=[1,1]"),
    "place": ("place", "plate.toml", *SMALL, *PLACE),
    "compare": ("compare", "plate.toml", "--robots", "ur5", "--workers", "0"),
    "study": ("study", "study.toml", "--out", "s.study", "--workers", "0"),
    "verify": ("verify", *SMALL, "plate.toml", "walk.csv"),
}
PAGES = ("check, infeasible", "divide", "explain", "compare", "study")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the cases, and a motion over the plate."""
    folder = tmp_path_factory.mktemp("answers")
    for name, text in TEXTS.items():
        (folder / f"{name}.toml").write_text(text)
    (folder / "study.toml").write_text('base.case = "plate.toml"\nvary."task.cone_deg" = [30]\n')
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main(["check", "plate.toml", *SMALL, "--witness", "walk.csv"]) == 0
    return folder


@pytest.fixture(autouse=True)
def inside(folder, monkeypatch):
    monkeypatch.chdir(folder)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_text_says_it_in_one_line(name, capsys) -> None:
    page = ("--html", "page.html") if name in PAGES else ()
    main([*COMMANDS[name], *page])
    captured = capsys.readouterr()
    said = [line for line in captured.out.splitlines() if UNCHECKED in line.lower()]
    if name == "path, none":  # an answer on stderr
        said = [line for line in captured.err.splitlines() if UNCHECKED in line.lower()]
    assert len(said) == 1, captured.out
    if page:
        assert UNCHECKED in html.unescape(Path("page.html").read_text("utf-8")).lower()


FAR = (
    *("--set", "robot.tcp.position=[0,0,0.15]", "--set", "collision.clearance=0.0"),
    *("--set", "collision.surface=false"),
)
WOULD_DO = (
    '[[collision.tool]] with kind = "capsule", radius = 0.01, length = 0.13, '
    "position = [0.0, 0.0, 0.075] would do"
)


@pytest.mark.parametrize(
    "name", ["check, feasible", "path", "divide", "explain", "place", "verify", "check, infeasible"]
)
def test_a_tool_without_a_body_is_named_with_what_would_do(name, capsys) -> None:
    page = ("--html", "page.html") if name in PAGES else ()
    main([*COMMANDS[name], *FAR, *page])
    said = " ".join(capsys.readouterr().out.split())
    bare = "the last 150 mm from tool0 to the TCP have no body, so nothing is checked there; "
    assert bare + WOULD_DO in said
    if page:
        assert WOULD_DO in html.unescape(Path("page.html").read_text("utf-8"))


@pytest.mark.parametrize("name", ["compare", "study"])
def test_answers_on_many_cases_name_a_tool_without_a_body(name, capsys, tmp_path) -> None:
    Path("far.toml").write_text(
        TEXTS["plate"].replace("[3, 4]", "[2, 2]")
        + "robot.tcp.position = [0, 0, 0.15]\n[collision]\nsurface = false\n"
    )
    Path("far study.toml").write_text('base.case = "far.toml"\nvary."task.cone_deg" = [30]\n')
    outputs = ("--html", "page.html", "--workers", "0")
    asked = ("far.toml", "--robots", "ur5")
    if name == "study":
        asked = ("far study.toml", "--out", str(tmp_path / "kept"))
    main([name, *asked, *outputs])
    words = "without a body, so not checked: tool0 to TCP ([[collision.tool]] gives a tool its"
    assert words in " ".join(capsys.readouterr().out.split())
    assert words in html.unescape(Path("page.html").read_text("utf-8"))


def test_the_body_that_would_do_does(capsys) -> None:
    shape = '[{kind="capsule",radius=0.01,length=0.13,position=[0.0,0.0,0.075]}]'
    assert main([*COMMANDS["check, feasible"], *FAR, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["unchecked_links"] == ["tool0 to TCP"]
    assert (
        main([*COMMANDS["check, feasible"], *FAR, "--set", f"collision.tool={shape}", "--json"])
        == 0
    )
    assert json.loads(capsys.readouterr().out)["unchecked_links"] == []


@pytest.mark.parametrize("name", COMMANDS)
def test_every_object_lists_no_collisions_as_checked(name, capsys) -> None:
    main([*COMMANDS[name], "--json"])
    assert json.loads(capsys.readouterr().out)["collisions"] == []


def test_trajectories_say_it_in_their_header_and_are_read_back() -> None:
    run = run_of("ur5")
    table, text = as_csv(run), as_json_text(run)
    assert table.splitlines()[0] == f"# {UNCHECKED}"
    assert json.loads(text)["collisions"] == []
    for again in (from_csv(table), from_json_text(text)):
        assert (again.q == run.q).all()
    older = json.loads(text)
    del older["collisions"]
    assert (from_json_text(json.dumps(older)).q == run.q).all()
    assert (from_csv(table.partition("\n")[2]).q == run.q).all()


def test_yaml_says_it_in_its_header(capsys) -> None:
    assert main([*COMMANDS["path"]]) == 0
    capsys.readouterr()
    assert f"# {UNCHECKED}" in Path("run.yaml").read_text("utf-8").splitlines()[:2]


def test_a_trajectory_with_its_header_can_be_judged(tmp_path) -> None:
    """`verify` and `--seeds` read it, and count lines as an editor does."""
    run = run_of("ur5")
    robot = small_case("plate").build().robot
    (tmp_path / "run.csv").write_text(as_csv(run))
    assert (load_motion(tmp_path / "run.csv", robot).q == run.q).all()
    lines = as_csv(run).splitlines()
    (tmp_path / "run.csv").write_text("\n".join([*lines[:3], "1,2", *lines[3:]]))
    with pytest.raises(ValueError, match="line 4"):
        load_motion(tmp_path / "run.csv", robot)
    (tmp_path / "run.csv").write_text("\n".join([lines[0], lines[1].replace("elbow", "knee")]))
    with pytest.raises(ValueError, match="line 2"):
        load_motion(tmp_path / "run.csv", robot)


def test_the_witness_stays_as_it_is(folder) -> None:
    assert (folder / "walk.csv").read_text().startswith("cell,shoulder_pan_joint,")


def test_answers_say_it_in_python_too() -> None:
    assert repr(small_verdict("plate")).lower().endswith(f"{UNCHECKED}.")
