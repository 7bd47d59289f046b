"""What newcomers read is true: the README's code runs, its commands exist, its table holds."""

import doctest
import inspect
import json
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
import tomllib
import webbrowser
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

import coverable
from coverable import Case, builtin_cases, check
from feasibility.cli.main import main

ROOT = Path(__file__).parents[1]
SITE = sorted((ROOT / "docs").glob("*.md"))
PAGES = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")] + SITE
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
README = (ROOT / "README.md").read_text("utf-8")
WRITTEN = {path.stem: path.read_text("utf-8") for path in SITE}
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


def blocks(text: str, language: str) -> list[str]:
    fenced = re.findall(r"^```(\w*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    return [inner for named, inner in fenced if named == language]


@pytest.mark.parametrize("page", [README, WRITTEN["first_cell"]], ids=["README", "first cell"])
def test_python_of_the_pages_runs_and_says_what_it_promises(page, capsys):
    (code,) = blocks(page, "python")
    names: dict[str, Any] = {}
    exec(compile(code, "page", "exec"), names)
    (promised,) = re.findall(r"# (feasible.*edges\.)", code)
    assert capsys.readouterr().out.startswith(promised)
    assert names["verdict"].graph.number_of_edges() == 305
    assert names["verdict"].witness.q.shape[1] == 6


def test_case_files_of_the_pages_are_feasible() -> None:
    (alone,), (collision,) = blocks(README, "toml"), blocks(WRITTEN["collisions"], "toml")
    (text,) = blocks(WRITTEN["first_cell"], "toml")
    assert check(*Case.from_toml(alone).build()).feasible
    clear = check(*Case.from_toml(f"{text}\n{collision}").build())
    assert clear.feasible
    assert clear.task.collision is not None
    assert clear.task.collision.checked == ("self", "surface", "scene")


def test_commands_of_the_pages_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for name, page in (("case", "first_cell"), ("study", "studies")):
        (text,) = blocks(WRITTEN[page], "toml")
        (tmp_path / f"{name}.toml").write_text(text.replace("count = 4 ", "count = 1 "))
    pages = [WRITTEN["first_cell"], *WRITTEN.values()]  # later ones use what the first writes
    found = [block for page in pages for block in blocks(page, "")]
    lines = dict.fromkeys(line for block in found for line in block.splitlines())
    commands = [shlex.split(x, comments=True) for x in lines if x.startswith("coverable")]
    monkeypatch.setattr(coverable.Live, "wait", Mock(side_effect=KeyboardInterrupt))
    assert len(commands) >= 18
    # Fewer cells and placements, no processes, and no browser windows.
    few, alone = "--set surface.cells=[3,4]", "--workers 0"
    more = {"show": "--html shown.html", "live": "--no-browser", "study": alone, "path": few,
            "explain": few, "compare": f"{few} {alone}",
            "place": f"--set surface.cells=[1,2] --count 4 {alone}"}  # fmt: skip
    for _, *arguments in commands:
        if arguments == ["warm-up"]:  # a campaign
            continue
        arguments += more.get(arguments[0], "").split()
        expected = 1 if arguments[1:2] == ["paper/4d"] and arguments[0] != "place" else 0
        assert main(arguments) == expected, arguments
        assert "usage" not in capsys.readouterr().err
    assert (tmp_path / "walk.csv").read_text().startswith("cell,joint1,")
    for page in ("shown.html", "where.html", "study.html"):
        assert (tmp_path / page).stat().st_size > 1e5
    assert (tmp_path / "where.png").read_bytes().startswith(b"\x89PNG")
    assert len((tmp_path / "table.csv").read_text().splitlines()) == 1 + 2 * 3 * 1


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_commands_and_links_exist(page: Path) -> None:
    text = page.read_text("utf-8")
    for target in re.findall(r"\]\((?!https?:)([^)#]+)\)", text):
        # `make docs` makes the figures.
        assert (page.parent / target).exists() or target.startswith("figures/"), target
    targets = re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    assert set(re.findall(r"\bmake ([a-z]+)`", text)) <= set(targets)
    made = {line.split()[1] for block in blocks(text, "") for line in block.splitlines()
            if line.startswith("make ")}  # fmt: skip
    assert made <= set(targets)
    for path in re.findall(r"\.venv/bin/python (?:-m pytest (?:\S+ )*)?([a-z]\S*/\S+?)[ `]", text):
        assert (ROOT / path).exists(), path


def table_of_cases() -> dict[str, dict[str, str]]:
    section = WRITTEN["paper"].split("\n## The twelve cases\n")[1].split("\n## ")[0]
    rows = re.findall(r"^\| (.*) \|$", section, re.M)
    head, *body = [row.split(" | ") for row in rows]
    return {row[0]: dict(zip(head, row, strict=True)) for row in body}


@pytest.mark.parametrize("name", builtin_cases())
def test_complete_columns_of_the_table(name: str) -> None:
    row = table_of_cases()[name.removeprefix("paper/")]
    verdict = check(*builtin_cases()[name].build())
    assert row["complete"].strip("*") == str(verdict.answer)
    assert row["evidence"] == str(verdict.evidence)
    assert int(row["covered"]) == verdict.n_covered
    # How much work it is differs a little from machine to machine.
    work = int(row["evaluations"].replace(",", ""))
    assert work == pytest.approx(verdict.statistics["fk"], rel=0.5)
    # Bold is where the paper sees no connected graph and a motion exists.
    missed = verdict.feasible and row["the paper says"] != "connected"
    assert row["complete"].startswith("**") is missed


def test_contributing_names_every_dependency() -> None:
    extras = PROJECT["optional-dependencies"]
    for requirement in [*PROJECT["dependencies"], *extras["dev"], *extras["docs"]]:
        name = re.split(r"[<>=]", requirement)[0]
        assert f"**{name}**" in CONTRIBUTING, f"{name}: why is it here?"


def test_files_that_contributing_and_trust_name_exist() -> None:
    names = re.findall(r"`([\w/]+\.(?:pyi?|toml)|[\w/]+/)`", CONTRIBUTING + WRITTEN["trust"])
    assert len(names) > 60
    for name in names:
        assert any(ROOT.glob(f"**/{name}" if "/" not in name.rstrip("/") else name)) or any(
            ROOT.glob(f"feasibility/{name}")
        ), name


def test_pages_and_notebooks_use_the_front_door_alone() -> None:
    sources = {"README.md": "\n".join(blocks(README, "python"))}
    for path in NOTEBOOKS:
        cells = json.loads(path.read_text("utf-8"))["cells"]
        sources[path.name] = "\n".join(
            "".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"
        )
    inside = re.compile(r"^\s*(from|import) (robots|surfaces|feasibility)\b", re.M)
    for name, source in sources.items():
        assert not inside.search(source), name
        assert "from coverable import" in source, name


def test_the_front_door_is_true() -> None:
    """Each name is there, and `except coverable.CoverableError` is enough for all errors."""
    assert dir(coverable) == sorted(coverable.__all__)
    for name in dir(coverable):
        one = getattr(coverable, name)
        assert one is not None
        assert not name.endswith("Error") or issubclass(one, coverable.CoverableError)
    with pytest.raises(AttributeError, match="no attribute 'sphare'"):
        coverable.sphare  # noqa: B018


def test_the_reference_lists_each_public_name_once() -> None:
    listed = re.findall(r"^\.\. auto\w+:: coverable\.(\w+)$", WRITTEN["reference"], re.M)
    assert sorted([*listed, "__version__"]) == dir(coverable)


def test_every_public_name_has_an_example_that_runs(tmp_path, monkeypatch):
    """In the reference, where examples follow each other, or in its docstring."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(webbrowser, "open", lambda url: False)
    pages = re.findall(r"^```pycon\n(.*?)^```$", WRITTEN["reference"], re.MULTILINE | re.DOTALL)
    shown = "".join(pages)
    for name in dir(coverable):
        one = getattr(coverable, name)
        parts = [one, *vars(one).values()] if inspect.isclass(one) else [one]
        own = any(">>>" in str(getattr(part, "__doc__", "")) for part in parts)
        assert own or re.search(rf"\b{name}\b", shown) or name == "__version__", name
    examples = doctest.DocTestParser().get_doctest(shown, {}, "reference", None, None)
    said: list[str] = []
    doctest.DocTestRunner().run(examples, out=said.append)
    assert not said, "".join(said)


def test_make_help_names_every_target() -> None:
    text = (ROOT / "Makefile").read_text("utf-8")
    targets = set(re.findall(r"^([a-z-]+):", text, re.MULTILINE))
    parts = {"help", "kernels", "greedy", "collected"}  # of others
    said = "\n".join(line for line in text.splitlines()[:13] if line.startswith("#"))
    assert set(re.findall(r"make ([a-z-]+)", said)) == targets - parts


def test_a_wheel_works_outside_the_checkout(tmp_path: Path) -> None:
    """Everything that it needs is in it: stubs of the rooms, built-in cases, the PUMA."""
    source = tmp_path / "source"
    kept = shutil.ignore_patterns(".*", "__pycache__", "tests", "notebooks", "build", "*.egg-info")
    shutil.copytree(ROOT, source, ignore=kept)
    build = ["-c", "from setuptools import build_meta; build_meta.build_wheel('..')"]
    subprocess.run(
        [sys.executable, *build], cwd=source, check=True, stdout=subprocess.DEVNULL, timeout=1800.0
    )
    (wheel,) = tmp_path.glob("*.whl")
    shutil.unpack_archive(wheel, tmp_path / "site", "zip")
    environment = os.environ | {"PYTHONPATH": str(tmp_path / "site"), "NUMBA_DISABLE_JIT": "1"}
    code = "import sys, coverable; from feasibility.cli.main import main; print(coverable.__file__)"
    code += "; [main(line.split()) for line in sys.argv[1:]]"
    asked = "check paper/4a --set surface.cells=[2,2] --save 4a.result --html 4a.html"
    done = subprocess.run(
        [sys.executable, "-c", code, asked, "show 4a.result --html shown.html"], cwd=tmp_path,
        env=environment, capture_output=True, text=True, check=True, timeout=1800.0,
    )  # fmt: skip
    place, said = done.stdout.split("\n", 1)
    assert place.startswith(str(tmp_path / "site"))
    assert said.startswith("feasible")
    pages = [file.relative_to(ROOT) for file in ROOT.glob("feasibility/*/page/*")]
    assert len({page.parent for page in pages}) == 2
    assert [page for page in pages if not (tmp_path / "site" / page).exists()] == []
    for page in ("4a.html", "shown.html"):
        assert (tmp_path / page).stat().st_size > 1e5


def test_citation_and_changelog_name_this_version() -> None:
    citation = (ROOT / "CITATION.cff").read_text("utf-8")
    fields = dict(re.findall(r"^([a-z-]+): *(\S.*)$", citation, re.MULTILINE))
    assert fields["cff-version"] == "1.2.0"
    assert all(fields[name] == PROJECT[name] for name in ("version", "license"))
    assert f"## {PROJECT['version']}" in (ROOT / "CHANGELOG.md").read_text("utf-8")


@pytest.mark.parametrize("name", ["search", "work", "process"])
def test_benchmarks_load(name: str) -> None:
    found = runpy.run_path(str(ROOT / f"tests/benchmarks/bench_{name}.py"))
    assert any(word.startswith("bench_") for word in found)
