"""The figures of `make bench` as JSON, and what `make bench-compare` says of two runs."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmark_compare import main
from benchmark_files import FORM, least, rows_by_name
from run import main as run

OLD: dict[str, Any] = {
    "form": FORM,
    "unit": "one call",
    "where": {"python": "3.11"},
    "tables": {
        "complete": {
            "rows": {
                "4a": {
                    "times": {"least": 20_000.0, "causes": None},
                    "counts": {"FK": 5952, "verdict": "feasible (replayed)"},
                    "others": {"peak MB": 200.0},
                },
                "4b": {"times": {"least": 1000.0}, "counts": {"FK": 8}, "others": {}},
            }
        }
    },
}
NOTHING = {
    "slower by more than 10 %": [],
    "counts that changed": [],
    "no longer there": [],
    "new": [],
    "faster by more than 10 %": [],
}


@pytest.fixture
def files(tmp_path: Path) -> list[str]:
    """The same run twice."""
    paths = [tmp_path / "old.json", tmp_path / "new.json"]
    for path in paths:
        path.write_text(json.dumps(OLD), encoding="utf-8")
    return [str(path) for path in paths]


def sections(text: str) -> dict[str, list[str]]:
    """The report by its headings, each of which says how many lines follow."""
    found: dict[str, list[str]] = {}
    counts: dict[str, int] = {}
    for line in text.splitlines():
        if line.startswith("  "):
            found[list(found)[-1]].append(line.strip())
        else:
            heading, count = line.split(": ")
            found[heading], counts[heading] = [], int(count)
    assert {heading: len(lines) for heading, lines in found.items()} == counts
    return found


def compared(files: list[str], capsys: pytest.CaptureFixture[str], new: Any) -> dict[str, Any]:
    """What a comparison with this new run says, and its exit status."""
    Path(files[1]).write_text(json.dumps(new), encoding="utf-8")
    status = main(files)
    said = capsys.readouterr()
    assert not said.err
    return {"status": status, **sections(said.out)}


def test_the_same_run_differs_in_nothing(files: list[str], capsys: Any) -> None:
    assert compared(files, capsys, OLD) == {"status": 0, **NOTHING}


@pytest.mark.parametrize(
    ("least", "status", "heading", "words"),
    [
        (22_100.0, 1, "slower by more than 10 %", "20,000 -> 22,100 FK calls (+10.5 %)"),
        (30_000, 1, "slower by more than 10 %", "20,000 -> 30,000 FK calls (+50.0 %)"),
        (10_000.0, 0, "faster by more than 10 %", "20,000 -> 10,000 FK calls (-50.0 %)"),
        (21_900.0, 0, None, ""),
        (18_300.0, 0, None, ""),
    ],
)
def test_times(
    files: list[str], capsys: Any, least: float, status: int, heading: str | None, words: str
) -> None:
    new = copy.deepcopy(OLD)
    new["tables"]["complete"]["rows"]["4a"]["times"]["least"] = least
    lines = {heading: [f"complete: 4a: least {words}"]} if heading else {}
    assert compared(files, capsys, new) == {"status": status, **NOTHING, **lines}


def test_counts_that_changed_at_all(files: list[str], capsys: Any) -> None:
    new = copy.deepcopy(OLD)
    row = new["tables"]["complete"]["rows"]["4a"]
    row["counts"] = {"FK": 5953, "verdict": "undecided"}
    row["others"]["peak MB"] = 900.0  # for the reader alone
    assert compared(files, capsys, new) == {
        "status": 0,
        **NOTHING,
        "counts that changed": [
            "complete: 4a: FK 5952 -> 5953",
            "complete: 4a: verdict feasible (replayed) -> undecided",
        ],
    }


def test_rows_columns_and_tables_that_are_missing_or_new(files: list[str], capsys: Any) -> None:
    new = copy.deepcopy(OLD)
    rows = new["tables"]["complete"]["rows"]
    rows["4c"] = rows.pop("4b")
    rows["4a"]["counts"].pop("FK")
    rows["4a"]["times"]["causes"] = 5.0
    new["tables"]["greedy"] = {"rows": {}}
    assert compared(files, capsys, new) == {
        "status": 0,
        **NOTHING,
        "no longer there": ["complete: 4b", "complete: 4a: FK"],
        "new": ["table greedy", "complete: 4c", "complete: 4a: causes"],
    }


@pytest.mark.parametrize("lost", [None, float("nan")])
def test_a_time_that_is_no_number_is_a_time_that_is_not_there(
    files: list[str], capsys: Any, lost: float | None
) -> None:
    new = copy.deepcopy(OLD)
    new["tables"]["complete"]["rows"]["4a"]["times"]["least"] = lost
    new["tables"]["complete"]["rows"]["4a"]["times"]["causes"] = float("nan")
    found = compared(files, capsys, new)
    assert found == {"status": 0, **NOTHING, "no longer there": ["complete: 4a: least"]}


def test_what_the_figures_depend_on_is_said(files: list[str], capsys: Any) -> None:
    new = {**OLD, "where": {"python": "3.12"}}
    Path(files[1]).write_text(json.dumps(new), encoding="utf-8")
    assert main(files) == 0
    assert capsys.readouterr().out.startswith("python: 3.11 -> 3.12\n")


def changed(**keys: Any) -> str:
    """A file with other values for some keys."""
    return json.dumps({**OLD, **keys})


BAD = {
    "{": "new.json: is not JSON: Expecting property name",
    "[" * 100_000: "new.json: is not JSON: ",
    "[]": 'new.json: was not written by make bench; expected "form"',
    changed(form="else"): 'new.json: was not written by make bench; expected "form"',
    changed(tables=[]): "new.json: tables must be a table of JSON, got list",
    changed(where=1): "new.json: where must be a table of JSON, got int",
    changed(tables={"a": {}}): "new.json: tables.a.rows must be a table of JSON, got NoneType",
    changed(tables={"a": {"rows": {"b": {"times": {"c": "fast"}, "counts": {}}}}}): (
        "new.json: tables.a.rows.b.times.c must be a number of at least 0, got 'fast'"
    ),
    changed(tables={"a": {"rows": {"b": {"times": {"c": -1}, "counts": {}}}}}): (
        "new.json: tables.a.rows.b.times.c must be a number of at least 0, got -1"
    ),
    changed(tables={"a": {"rows": {"b": {"times": {}, "counts": {"c": []}}}}}): (
        "new.json: tables.a.rows.b.counts.c must be a number or a text"
    ),
    changed(tables={"a": {"rows": {}}}): "the two files have no table in common",
}


@pytest.mark.parametrize("text", BAD, ids=lambda text: text[:12])
def test_a_bad_file_is_one_sentence(files: list[str], capsys: Any, text: str) -> None:
    Path(files[1]).write_text(text, encoding="utf-8")
    assert main(files) == 2
    said = capsys.readouterr()
    assert BAD[text] in said.err
    assert said.err.count("\n") == 1
    assert not said.out


def test_files_that_are_missing(files: list[str], capsys: Any) -> None:
    assert main([files[0], f"{files[1]}.none"]) == 2
    assert "new.json.none: there is no such file" in capsys.readouterr().err
    for given in ([], [files[0]], ["", files[0]]):
        assert main(given) == 2
        assert "make bench-compare OLD=old.json NEW=new.json" in capsys.readouterr().err


def test_names_of_columns_say_what_they_hold() -> None:
    row = {
        "case": "4a",
        "moves": "single",
        "cut s": np.float64(0.5),
        "verdict ms (goal 3)": 2,
        "an edge us": 0.25,
        "judge ms of 200 waypoints (goal 40)": 1.0,
        "causes ms": "",
        "other ms": float("nan"),
        "FK": np.int64(7),
        "same table": np.True_,
        "a machine's size": "small",
        "time ratio": 1.5,
        "in Pinocchio FK": 100,
        "peak MB": 4,
        "duration s": 9.0,
        "target": "20 ms",
        "share": float("nan"),
    }
    assert rows_by_name([row, {**row, "moves": "all"}], fk_us=0.5).keys() == {
        "4a, single",
        "4a, all",
    }
    assert rows_by_name([row], fk_us=0.5) == {
        "4a": {
            "times": {
                "cut": 1e6,
                "verdict": 4000.0,
                "an edge": 0.5,
                "judge of 200 waypoints": 2000.0,
                "causes": None,
                "other": None,
            },
            "counts": {
                "case": "4a",
                "moves": "single",
                "FK": 7,
                "same table": True,
                "a machine's size": "small",
            },
            "others": {
                "time ratio": 1.5,
                "in Pinocchio FK": 100,
                "peak MB": 4,
                "duration s": 9.0,
                "target": "20 ms",
                "share": None,
            },
        }
    }


def test_rounds_keep_the_least_time_of_each_figure() -> None:
    rounds = [
        {"a": {"times": {"one": one, "other": other}, "counts": {"FK": fk}, "others": {}}}
        for one, other, fk in ((2.0, 5.0, 1), (3.0, 4.0, 1), (4.0, None, 2))
    ]
    assert least([{}, *rounds]) == {
        "a": {"times": {"one": 2.0, "other": 4.0}, "counts": {"FK": 2}, "others": {}}
    }


def test_a_run_writes_what_it_prints(tmp_path: Path, capsys: Any) -> None:
    (tmp_path / "bench_made_up.py").write_text(
        "from pathlib import Path\n"
        "def rows():\n"
        "    before = Path(__file__).with_suffix('.count')\n"
        "    taken = 0.75 if before.exists() else 0.5\n"
        "    before.touch()\n"
        "    return 'Made up', [{'case': 'a', 'search s': taken, 'FK': 12}]\n"
    )
    (tmp_path / "bench_broken.py").write_text("def rows():\n    raise RuntimeError('broken')\n")
    path = tmp_path / "out" / "bench.json"
    assert run(["made", "--rounds", "2", "--json", str(path)], tmp_path) == 0
    printed = capsys.readouterr().out
    assert "| a    | 0.5      | 12 |" in printed
    assert "| a    | 0.75     | 12 |" in printed
    written = json.loads(path.read_text("utf-8"))
    table = written["tables"]["made_up"]
    assert written["form"] == FORM
    assert 0.0 < table["fk_us"] < 1000.0
    row = table["rows"]["a"]
    assert row["times"]["search"] == pytest.approx(5e5 / table["fk_us"], rel=1e-5)
    assert row["counts"] == {"case": "a", "FK": 12}
    assert main([str(path), str(path)]) == 0
    with pytest.raises(RuntimeError, match="broken"):
        run(["--json", str(path)], tmp_path)
    assert json.loads(path.read_text("utf-8")) == written
    assert [p.name for p in path.parent.iterdir()] == ["bench.json", "bench.json.unfinished"]
    with pytest.raises(SystemExit):
        run(["nothing"], tmp_path)
    assert "no table has a name with nothing in it" in capsys.readouterr().err
