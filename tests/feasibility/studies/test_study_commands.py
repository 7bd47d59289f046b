"""`coverable study`, `compare` and `place` as they are typed: status, output, files, bad input."""

from __future__ import annotations

import csv
import io
import itertools
import json
import math
import re
from collections import Counter
from html import escape
from html.parser import HTMLParser

import numpy as np
import pytest
from small_cases import TEXTS

from feasibility import check
from feasibility.cases import load_case
from feasibility.placement import Pose
from feasibility.reports.placement import settings_of
from feasibility.reports.study_plot import charts
from feasibility.studies import Row

SMALL = ("--set", "surface.cells=[3,3]")
HERE = ("--workers", "0")
STUDY = """
base.case = "plate.toml"
vary.robots = ["ur5", "xarm7"]
vary."surface.position".x = [0.0, 0.3, 2.0]
"""


REGION = """
vary."surface.position".y = {{ range = {} }}
vary.count = 4
"""


def object_in(text):
    """The one JSON object that a text is, without NaN or infinities."""
    told = json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))
    assert isinstance(told, dict)
    return told


def table_of(path):
    """The rows of a CSV file."""
    return list(csv.DictReader(io.StringIO(path.read_text(encoding="utf-8"))))


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """A folder with a case and a study, where the commands run."""
    (tmp_path / "plate.toml").write_text(TEXTS["plate"], encoding="utf-8")
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


# -- study ------------------------------------------------------------------------------------


def test_each_row_of_a_study_is_what_check_says(folder, ask) -> None:
    """Every row, as JSON and as CSV, against the verdict on a case made by hand."""
    status, out, err = ask(
        "study", "study.toml", "--out", "run.study", "--csv", "run.csv", "--json", *HERE
    )
    assert status == 0
    told = object_in(out)
    assert told["tasks"] == len(told["rows"]) == 6
    verdicts = []
    for row in told["rows"]:
        name, x = (row["parameters"][key] for key in ("robot", "surface.position.x"))
        settings = [f"robot.name={name}", f"surface.position=[{x}, 0, 0.3]"]
        verdict = check(*load_case("plate.toml", settings).build())
        assert (row["verdict"], row["covered"]) == (str(verdict.answer), verdict.n_covered)
        assert (row["evidence"], row["message"]) == (str(verdict.evidence), verdict.message)
        verdicts.append(str(verdict.answer))
    assert told["verdicts"] == {
        name: verdicts.count(name) for name in ("feasible", "infeasible", "undecided")
    }
    assert min(told["verdicts"]["feasible"], told["verdicts"]["infeasible"]) > 0
    lines = table_of(folder / "run.csv")
    assert [line["verdict"] for line in lines] == verdicts
    assert [float(line["share"]) for line in lines] == [row["share"] for row in told["rows"]]
    assert "run.csv" in err


def test_a_study_goes_on_from_what_is_kept(folder, ask, monkeypatch) -> None:
    """A second run decides the new cases alone, and prints the same rows as a fresh one."""
    (folder / "first.toml").write_text(STUDY.replace(", 2.0]", "]"), encoding="utf-8")
    assert ask("study", "first.toml", "--out", "run.study", *HERE)[0] == 0
    from feasibility.studies import scheduling

    submitted = []
    run_one = scheduling.run_one

    def counted(work, tables):
        submitted.append(tables)
        return run_one(work, tables)

    monkeypatch.setattr(scheduling, "run_one", counted)
    status, out, err = ask(
        "study", "study.toml", "--out", "run.study", "--csv", "a.csv", "--json", *HERE
    )
    assert status == 0
    assert "4 finished cases" in err
    assert [t["surface"]["position"][0] for t in submitted] == [2.0, 2.0]
    assert object_in(out)["tasks"] == 6
    fresh = ask("study", "study.toml", "--out", "new.study", "--csv", "b.csv", *HERE)
    assert fresh[0] == 0
    assert len(submitted) == 2 + 6
    assert (folder / "a.csv").read_bytes() == (folder / "b.csv").read_bytes()
    assert "6 cases" in fresh[1]


def test_a_process_of_its_own_gives_the_same_table(folder, ask) -> None:
    for count in ("0", "1"):
        files = ("--out", f"{count}.study", "--csv", f"{count}.csv", "--workers", count)
        assert ask("study", "study.toml", *files)[0] == 0
    assert (folder / "0.csv").read_bytes() == (folder / "1.csv").read_bytes()
    assert len(table_of(folder / "1.csv")) == 6


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('base.case = "plate.toml"\nvary.robbots = ["ur5"]', ["vary.robbots", "robots"]),
        (STUDY + 'extra = 1\n', ["extra: is not known here"]),
        (STUDY.replace("position", "positon"), ["positon"]),
        ('base.case = "plate.toml"\nvary.robots = ["ur5", "robby"]', ["vary.robots[1]", "robby"]),
        ('base.case = "plate.toml"\nvary.robots = []', ["vary.robots"]),
        # An empty region, and one without an end.
        (STUDY + REGION.format("[0.4, 0.2]"), ["surface.position.y.range", "the wrong way"]),
        (STUDY + REGION.format("[0.4, 0.4]"), ["position.y.range", "an empty range"]),
        (STUDY + REGION.format("[0.4, inf]"), ["position.y.range", "finite"]),
        ('base.case = "plate.toml"\n[vary]\n"task.cone_deg" = [20, nan]', ["task.cone_deg"]),
        ('base.case = "none.toml"\nvary.robots = ["ur5"]', ["base.case: there is no such file"]),
        ('vary.robots = ["ur5"]', ["base: is missing"]),
        ("base = [", ["study.toml"]),
        # Several at once: all of them in the one message.
        ('other = 1\nbase.case = "none.toml"\nvary.robbots = 1',
         ["other: is not known", "base.case: there is no such file", "vary.robbots"]),
    ],
)  # fmt: skip
def test_a_bad_study_is_one_message(text, words, folder, ask) -> None:
    (folder / "study.toml").write_text(text, encoding="utf-8")
    assert_refused(ask("study", "study.toml", "--out", "run.study", *HERE), words)
    assert not (folder / "run.study").exists()


def assert_refused(outcome, words) -> None:
    """Status 2, nothing on stdout, one message with all of the words and no traceback."""
    status, out, err = outcome
    assert status == 2, err
    assert out == ""
    for word in words:
        assert word in err
    assert [line.startswith("coverable") for line in err.splitlines()].count(True) == 1
    assert "Traceback" not in err
    assert "bug in coverable" not in err
    assert err.endswith("\n")


def test_what_is_kept_is_not_lost_to_a_bad_run(folder, ask) -> None:
    """A study that is refused, and a file that is no store, leave the files as they were."""
    assert ask("study", "study.toml", "--out", "run.study", *HERE)[0] == 0
    (folder / "bad.toml").write_text(STUDY + "extra = 1", encoding="utf-8")
    assert_refused(ask("study", "bad.toml", "--out", "run.study", *HERE), ["extra"])
    status, _, err = ask("study", "study.toml", "--out", "run.study", *HERE)
    assert status == 0
    assert "6 finished cases" in err
    before = (folder / "plate.toml").read_bytes()
    assert_refused(ask("study", "study.toml", "--out", "plate.toml", *HERE), ["plate.toml"])
    assert (folder / "plate.toml").read_bytes() == before


# -- compare ----------------------------------------------------------------------------------


def test_compare_says_of_each_arm_what_check_says(folder, ask) -> None:
    status, out, _ = ask(
        "compare", "plate.toml", "--set", "surface.position=[0.3, 0, 0.3]", *HERE,
        "--robots", "ur5, xarm7", "--json", "--csv", "a.csv", "--html", "a.html",
    )  # fmt: skip
    assert status == 0
    told = object_in(out)
    assert [arm["robot"] for arm in told["robots"]] == ["ur5", "xarm7"]
    for arm in told["robots"]:
        settings = [f"robot.name={arm['robot']}", "surface.position=[0.3, 0, 0.3]"]
        verdict = check(*load_case("plate.toml", settings).build())
        assert (arm["verdict"], arm["message"]) == (str(verdict.answer), verdict.message)
        assert arm["covered"] == verdict.n_covered
    assert sorted(told["ranking"]) == ["ur5", "xarm7"]
    lines = table_of(folder / "a.csv")
    assert [line["verdict"] for line in lines] == [arm["verdict"] for arm in told["robots"]]
    assert "xarm7" in (folder / "a.html").read_text(encoding="utf-8")


# -- place ------------------------------------------------------------------------------------


def test_a_placement_fed_back_is_feasible(folder, ask) -> None:
    """Infeasible where it stands; what `place` answers, `check` accepts, from the same shell."""
    far = ("--set", "surface.position=[0.6, 0, 0.3]")
    assert ask("check", "plate.toml", *far)[0] == 1
    status, out, _ = ask(
        "place", "plate.toml", *far, *SMALL, "--x", -0.2, 0.6, "--yaw", -20, 20,
        "--count", 8, "--json", "--csv", "p.csv", "--out", "p.study", *HERE,
    )  # fmt: skip
    assert status == 0
    told = object_in(out)
    assert told["answer"] == "feasible"
    for found in told["placements"]:
        assert -0.2 <= found["position"][0] <= 0.6
        assert -20 <= found["rpy_deg"][2] <= 20
        pose = Pose.of_values([*found["position"], *found["rpy_deg"]])
        sets = [part for text in settings_of(pose) for part in ("--set", text)]
        assert ask("check", "plate.toml", *SMALL, *sets)[0] == 0
    lines = table_of(folder / "p.csv")
    assert sum(line["verdict"] == "feasible" for line in lines) >= len(told["placements"]) > 0


def test_none_in_a_region_is_status_1_with_the_cause(ask) -> None:
    status, out, _ = ask(
        "place", "plate.toml", *SMALL, "--x", 2.5, 3, "--json", "--stations", *HERE
    )
    assert status == 1
    told = object_in(out)
    assert (told["answer"], told["evidence"]) == ("infeasible", "proof")
    assert told["cause"] == "out_of_reach"
    assert told["placements"] == []
    assert told["stations"]["stations"] == []
    assert told["stations"]["left_out"] == list(range(9))


def test_stations_share_out_what_no_placement_covers_alone(ask) -> None:
    """Every cell to exactly one station, each with a replayed motion, two at the proven least."""
    long = ["surface.u=[-0.1, 0.1]", "surface.v=[-0.9, 0.9]", "surface.cells=[1, 9]",
            "surface.position=[0.5, 0, 0.3]"]  # fmt: skip
    sets = [part for text in long for part in ("--set", text)]
    status, out, _ = ask(
        "place", "plate.toml", *sets, "--y", -0.6, 0.6, "--count", 8, "--stations",
        "--json", *HERE,
    )  # fmt: skip
    assert status == 1
    told = object_in(out)["stations"]
    assert sorted(cell for one in told["stations"] for cell in one["cells"]) == list(range(9))
    assert all(one["certified"] for one in told["stations"])
    assert told["left_out"] == []
    assert told["optimal"]
    assert len(told["stations"]) == told["at_least"] == 2


# -- bad input --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["study", "none.toml", "--out", "run.study"], ["none.toml"]),
        (["study", ".", "--out", "run.study"], ["study file"]),
        (["study", "study.toml", "--out", "no/folder/run.study"], ["no/folder"]),
        (["study", "study.toml", "--out", "r.study", "--csv", "no/folder/t.csv"], ["no/folder"]),
        (["study", "study.toml"], ["--out"]),
        (["compare", "none.toml", "--robots", "ur5"], ["none.toml"]),
        (["compare", "plate.toml", "--robots", "ur5,robby"], ["--robots[1]", "robby"]),
        (["compare", "plate.toml", "--robots", "robby,ur5,ur5"], ["[0]", "[2]", "named twice"]),
        (["compare", "plate.toml", "--robots", " , "], ["--robots", "is empty"]),
        (["compare", "plate.toml", "--robots", "ur5", "--html", "no/folder/x.html"],
         ["no/folder"]),
        (["place", "none.toml", "--x", "0", "1"], ["none.toml"]),
        (["place", "plate.toml"], ["nothing varies"]),
        (["place", "plate.toml", "--x", "1", "0"], ["x: 1 .. 0 is empty"]),
        (["place", "plate.toml", "--x", "1", "0", "--yaw", "0", "400"], ["x: 1", "yaw_deg: 0"]),
        (["place", "plate.toml", "--x", "nan", "1"], ["x: nan .. 1 is no range"]),
        (["place", "plate.toml", "--x", "0"], ["--x"]),
        (["place", "plate.toml", "--x", "0", "1", "--count", "0"], ["count"]),
        (["place", "plate.toml", "--x", "0", "1", "--map", "map.txt"], ["map.txt"]),
        (["place", "plate.toml", "--x", "0", "1", "--set", "robot.name=robby"], ["robby"]),
        (["place", "plate.toml", "--x", "0", "1", "--set", "task.cone=3"], ["task.cone"]),
    ],
)  # fmt: skip
def test_bad_input_is_one_message(argv, words, ask) -> None:
    assert_refused(ask(*argv, *HERE), words)


def test_processes_and_dask_together_are_refused(ask) -> None:
    both = ("--workers", "1", "--dask", "tcp://127.0.0.1:1")
    assert_refused(ask("compare", "plate.toml", "--robots", "ur5", *both), ["--workers"])


# -- pages ------------------------------------------------------------------------------------


class Page(HTMLParser):
    """What a page shows: its tags, the rows of its tables, and its text outside of the drawings."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.rows, self.frames = Counter(), [], []
        self.inside, self.text = None, ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags[tag] += 1
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
        self.inside = tag
        if tag == "iframe":
            self.frames.append(dict(attrs)["srcdoc"])

    def handle_endtag(self, tag):
        self.inside = None

    def handle_data(self, data):
        if self.inside in ("td", "th"):
            self.rows[-1][-1] += data
        elif self.inside in ("h1", "h2", "p", "figcaption", "span"):
            self.text += data + "\n"


def page_of(folder, ask, name="study.toml", more=()):
    """The page of a study, and the study's own account of its rows."""
    files = ("--out", "run.study", "--html", "page.html")
    status, out, err = ask("study", name, *files, "--json", *more, *HERE)
    assert status == 0
    assert "page: page.html" in err
    return (folder / "page.html").read_text(encoding="utf-8"), object_in(out)


def test_the_page_of_a_study_counts_as_its_table_does(folder, ask) -> None:
    """Verdicts, every value of what varies, the best rows and the poses, against the JSON."""
    text, told = page_of(folder, ask)
    page = Page(text)
    found = {name: number for name, number in told["verdicts"].items() if number}
    for name, number in found.items():
        assert f"{number} {name}</span>" in text
    for key in ("robot", "surface.position.x"):
        for value in dict.fromkeys(row["parameters"][key] for row in told["rows"]):
            mine = [row for row in told["rows"] if row["parameters"][key] == value]
            share = max(row["share"] for row in mine)
            says = value if key == "robot" else f"{value:g}"
            numbers = [str(sum(row["verdict"] == name for row in mine)) for name in found]
            assert [says, *numbers, f"{100 * share:.1f} %", ""] in page.rows
    best = max(told["rows"], key=lambda row: (row["margins"] or {}).get("limit_deg", -1.0))
    first = next(row for row in page.rows if row[0] == "feasible")
    limit = f"{best['margins']['limit_deg']:.1f} deg"
    x, arm = best["parameters"]["surface.position.x"], best["parameters"]["robot"]
    assert first == ["feasible", "100.0 %", limit, arm, f"{x:g}"]
    # One chart over the one number that varies, and the poses of the best row's arm.
    assert page.tags["figure"] == 1
    assert "Covered share over surface x (m)" in page.text
    (frame,) = page.frames
    assert page.tags["img"] == 1  # of the poses, for paper
    drawn = Page(frame)
    assert "3 of 6 cases" in drawn.text
    good = sum(r["verdict"] == "feasible" and r["parameters"]["robot"] == arm for r in told["rows"])
    assert f"feasible ({good})" in frame


def test_the_page_of_a_study_fetches_nothing_and_repeats_no_name(folder, ask) -> None:
    text, _ = page_of(folder, ask)
    program = re.search(r"id=&quot;program&quot;&gt;([^&]*)&lt;", text)[1]
    assert len(program) > 100_000
    rest = text.replace(program, "")
    assert not re.search(r"https?:|(?:src|href)=[\"']?//|@import|url\((?!#)", rest)
    names = re.findall(r' id="([^"]*)"', text)
    assert len(names) == len(set(names))
    again, _ = page_of(folder, ask)
    assert again == text


def test_names_out_of_files_are_text_on_the_page(folder, ask) -> None:
    """A description, a file's name, an arm's file: no tag more than with harmless names."""
    tags, bad = [], "<img src=x onerror=alert(1)>&\"'"
    urdf = (
        '<robot name="{0}"><link name="base"/><link name="tip"/><joint name="j" type="prismatic">'
        '<parent link="base"/><child link="tip"/><axis xyz="1 0 0"/>'
        '<limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    for k, name in enumerate(("plain", bad)):
        (folder / f"{name}.urdf").write_text(urdf.format(escape(name)), encoding="utf-8")
        study = (
            f"description = {json.dumps('about ' + name)}\n"
            + STUDY.replace(
                '"xarm7"', json.dumps({"urdf": f"{name}.urdf"}).replace(":", "=")
            ).replace(", 2.0]", "]")
            + 'vary."task.cone_deg" = [20, 30]\n'
        )
        (folder / f"{name}.toml").write_text(study, encoding="utf-8")
        files = ("--out", f"{k}.study", "--html", f"{k}.html")
        status, _, err = ask("study", f"{name}.toml", *files, *HERE)
        assert status == 0, err
        text = (folder / f"{k}.html").read_text(encoding="utf-8")
        page = Page(text)
        assert any(json.dumps(name)[1:-1] in cell for row in page.rows for cell in row)
        assert f"about {name}" in page.text
        tags.append((page.tags, Page(page.frames[0]).tags))
    assert tags[0] == tags[1]
    assert bad not in text


def test_a_study_whose_surface_stays_has_no_picture_of_poses(folder, ask) -> None:
    """Two numbers vary: a chart for each, and the map of both with a field for each pair."""
    text = 'base.case = "plate.toml"\nvary."task.cone_deg" = [10, 20, 30]\n'
    text += 'vary."task.standoff" = [0.01, 0.02]\n'
    (folder / "cones.toml").write_text(text, encoding="utf-8")
    page = Page(page_of(folder, ask, "cones.toml")[0])
    assert page.frames == []
    assert page.tags["figure"] == 3
    assert "Best covered share over task.cone_deg and task.standoff" in page.text


def test_maps_show_the_best_of_each_field_and_leave_out_what_failed() -> None:
    """Every number written into a map against a maximum taken by hand, one map for each arm."""
    values = {"robot": ["ur5", "<b>"], "a": [1, 2, 3], "b": [0.5, 0.7], "c": [4, 9], "d": [0, 1]}
    rng = np.random.default_rng(3)
    rows = []
    for row in itertools.product(*values.values()):
        share = float(rng.uniform(0.0, 0.9999))
        result = {"verdict": "infeasible", "share": share}
        if rng.random() < 0.1:
            result = {"verdict": "undecided", "evidence": "budget", "message": "died"}
        rows.append(Row(dict(zip(values, row, strict=True)), "done", result, 0.1))
    made = charts(list(values), rows)
    numbers = ["a", "b", "c", "d"]
    captions = [chart.caption for chart in made.drawn]
    assert captions[:4] == [f"Covered share over {name}" for name in numbers]
    pairs = list(itertools.combinations(numbers, 2))[:3]
    assert captions[4:] == [
        f"Best covered share over {x} and {y}, robot = {arm}" for x, y in pairs
        for arm in values["robot"]
    ]  # fmt: skip
    assert made.left_out == 3
    drawn = iter(made.drawn[4:])
    for (x, y), arm in itertools.product(pairs, values["robot"]):
        written = re.findall(r'<text style="font-size: 8px[^>]*>(\d+)</text>', next(drawn).svg)
        best = [
            max(
                100 * row.result["share"] for row in rows
                if "share" in row.result and row.parameters["robot"] == arm
                and (row.parameters[x], row.parameters[y]) == (i, j)
            )
            for j in values[y] for i in values[x]
        ]  # fmt: skip
        assert written == [str(math.floor(share)) for share in best]


def test_place_draws_what_it_tried(folder, ask) -> None:
    """As many poses in the legend as in the table, class by class."""
    status, _, err = ask(
        "place", "plate.toml", *SMALL, "--x", -0.2, 0.6, "--count", 8,
        "--csv", "p.csv", "--html", "p.html", *HERE,
    )  # fmt: skip
    assert status == 0
    assert "view: p.html" in err
    text = (folder / "p.html").read_text(encoding="utf-8")
    lines = table_of(folder / "p.csv")
    drawn = dict(re.findall(r"<label[^>]*>.*?</i>([a-z][^<]*?) \((\d+)\)</label>", text))
    assert drawn.pop("feasible") == str(sum(line["verdict"] == "feasible" for line in lines))
    known = [line for line in lines if line["verdict"] != "feasible"]
    unsearched = sum(line["stage"] in ("bound", "probe") for line in known)
    assert int(drawn.pop("ruled out without a search", 0)) == unsearched
    whole = sum(float(line["share"]) == 1.0 for line in known)
    assert int(drawn.pop("covered by a search, not replayed", 0)) == whole
    assert "pause" in text


def test_a_region_ruled_out_by_proof_has_no_share_to_tell(ask) -> None:
    """Nothing was searched there, so 0 % would be a claim that nobody has looked into."""
    where = ("place", "plate.toml", *SMALL, "--x", 2.5, 3)
    status, out, _ = ask(*where, *HERE)
    assert status == 1
    assert "%" not in out
    assert "the best of them" not in out
    assert "share     not known" in out
    told = object_in(ask(*where, "--json", *HERE)[1])
    assert told["share"] is None
    assert told["best"]["stage"] == "bound"


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["study", "study.toml", "--out", "s", "--csv", "t", "--html", "t"],
         ["is also the file of"]),
        (["study", "study.toml", "--out", "s", "--html", "s"],
         ["--html s: is also the file of --out"]),
        (["study", "study.toml", "--out", "s", "--html", "./study.toml"],
         ["--html ./study.toml: is the input file"]),
        (["study", "study.toml", "--out", "s", "--html", "no/x.html", "--csv", "study.toml"],
         ["--html no/x.html: there is no folder", "--csv study.toml: is the input file"]),
        (["compare", "plate.toml", "--robots", "ur5", "--html", "plate.toml"],
         ["is the input file"]),
        (["place", "plate.toml", "--x", "0", "1", "--html", "m.svg", "--map", "m.svg"],
         ["m.svg: is also the file of --map"]),
        (["place", "plate.toml", "--x", "0", "1", "--html", "plate.toml"],
         ["--html plate.toml: is the input file"]),
        (["place", "plate.toml", "--x", "0", "1", "--map", "m.txt"],
         ["--map: m.txt is no kind of picture"]),
        (["place", "plate.toml", "--x", "0", "1", "--html", "."], ["--html .: is a folder"]),
    ],
)  # fmt: skip
def test_outputs_that_clash_are_refused_before_anything_is_tried(
    argv, words, folder, ask, monkeypatch
) -> None:
    def refuse(*_):
        raise AssertionError("something was tried")

    monkeypatch.setattr("feasibility.studies.scheduling.run_one", refuse)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert_refused(ask(*argv, *HERE), words)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
