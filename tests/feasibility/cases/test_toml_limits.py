"""TOML that is too deep or too long is refused before the parser sees it; strings are no matter."""

from __future__ import annotations

import random
import tomllib

import pytest
from bad_cases import GOOD

from feasibility.cases import CaseError, toml_document
from feasibility.cases.case import Case, builtin_cases
from feasibility.cases.toml import (
    MOST_BRACKETS,
    MOST_KEYS,
    MOST_PARTS,
    TomlError,
    parse_setting,
    parse_toml,
    too_much,
)
from feasibility.studies.file import read_study

PARTS = ("a", '"a"', "'a'", '"a\\""', '"#"', '"["', "''", "1", "a-b", '"é"')
DOTS = (".", " .", ". ", "\t.\t")


def long_key(rng: random.Random, parts: int) -> str:
    """A dotted key, its parts and dots in any of their forms."""
    return "a" + "".join(rng.choice(DOTS) + rng.choice(PARTS) for _ in range(parts - 1))


def deep_value(rng: random.Random, depth: int) -> str:
    """Arrays and inline tables inside each other."""
    forms = (
        ("[", "]"),
        ("[0, ", "]"),
        ('[\'[\', "]\\"", # ]\n', "]"),
        ("{a = ", "}"),
        ("{'}' =", "}"),
    )
    text = "1"
    for _ in range(depth):
        before, after = rng.choice(forms)
        text = f"{before}{text}{after}"
    return text


def too_deep(seed: int) -> str:
    """A document with one thing in it that is a little or much too deep."""
    rng = random.Random(seed)
    parts = MOST_PARTS + rng.choice((1, 2, 10, 300))
    depth = MOST_BRACKETS + rng.choice((1, 2, 10, 300))
    key, value = long_key(rng, parts), deep_value(rng, depth)
    before = rng.choice(('b = "["\n', "'#' = 1\n", 'c = """]]" \\""" ]\n"""\n', "# ]]]]\n", ""))
    forms = f"{key} = 1", f"[{key}]", f"[[ {key} ]]", f"x = {{{key} = 1}}", f"x = {value}"
    return before + rng.choice(forms)


@pytest.mark.parametrize("seed", range(60))
def test_too_deep_a_document_never_gets_to_the_parser(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def loads(_: str) -> None:
        pytest.fail("the parser was called")

    text = too_deep(seed)
    monkeypatch.setattr(tomllib, "loads", loads)
    with pytest.raises(TomlError, match=r"is nested too deeply: .*, more than \d+"):
        parse_toml(text)
    with pytest.raises(CaseError, match="nested too deeply"):
        Case.from_toml(text)
    with pytest.raises(CaseError, match="nested too deeply"):
        read_study(text)


@pytest.mark.parametrize("seed", range(30))
def test_too_deep_a_setting_never_gets_to_the_parser(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = random.Random(seed)
    case = builtin_cases()["paper/4a"]
    key = long_key(rng, MOST_PARTS + rng.choice((1, 2, 500)))
    value = deep_value(rng, MOST_BRACKETS + rng.choice((1, 2, 500)))
    monkeypatch.setattr(tomllib, "loads", lambda _: pytest.fail("the parser was called"))
    for setting in (f"task.{key}=1", f"task.cone_deg={value}", f"task.cone_deg={{{key} = 1}}"):
        with pytest.raises(TomlError, match=r"nested too deeply: .*; expected table\.key=value"):
            parse_setting(setting)
    monkeypatch.undo()
    with pytest.raises(CaseError, match=r"--set .*nested too deeply"):
        case.with_overrides([f"task.{key}=1"])


def test_too_many_keys_are_counted_before_the_parser() -> None:
    many = "\n".join(f"k{k} = {k}" for k in range(MOST_KEYS + 1))
    tables = "\n".join(f"[a.b.k{k}]" for k in range(MOST_KEYS // 3 + 1))
    for text in (many, tables):
        with pytest.raises(TomlError, match=rf"has 50,00\d keys, more than {MOST_KEYS:,}"):
            parse_toml(text)


def test_what_a_string_or_a_comment_holds_does_not_count() -> None:
    brackets, dots, equals = "[" * 99, "a." * 99 + "a", "a = 1, " * (MOST_KEYS + 1)
    for inside in (brackets, dots, equals):
        rows = [f'a = "{inside}"', f"a = '{inside}'", f'a = """\n{inside}"\\""" """', f"#{inside}"]
        for row in rows:
            assert too_much(row) == ""
            assert parse_toml(row) == tomllib.loads(row)


def test_what_is_just_not_too_much_is_read() -> None:
    for text in (
        f"x = {'[' * MOST_BRACKETS}{']' * MOST_BRACKETS}",
        f"{long_key(random.Random(1), MOST_PARTS)} = 1",
        "\n".join(f"k{k} = {k}.5" for k in range(MOST_KEYS)),
        GOOD,
    ):
        assert parse_toml(text) == tomllib.loads(text)


def test_the_deepest_document_is_one_message_and_no_recursion() -> None:
    """What the caps let through in all its depths at once is refused too, or by the readers."""
    path = ".".join("a" * MOST_PARTS)
    levels = MOST_BRACKETS - 1
    inside = f"{{{path} = " * levels + "1" + "}" * levels
    for title in ("robot", "surface", "task"):
        for value in (inside, "1", "[" * levels + "]" * levels):
            text = GOOD.replace(f"[{title}]\n", f"[{title}]\n{path} = {value}\n")
            with pytest.raises(CaseError, match=r"nested too deeply: at most 8|not known here"):
                Case.from_toml(text)
        for row in (f'"{title}.a" = [{inside}]', f"{title}.{path[2:]} = {inside}"):
            with pytest.raises(CaseError, match="nested too deeply"):
                read_study(f'base.case = "paper/4a"\n[vary]\n{row}')
        with pytest.raises(
            CaseError, match=r"nested too deeply: at most 8 tables.*; expected table"
        ):
            builtin_cases()["paper/4a"].with_overrides([f"{title}.{path[2:]}={{{path}=1}}"])


def test_what_is_read_can_be_written_and_read_again() -> None:
    path = ".".join("a" * (MOST_PARTS // 2))
    for text in (f"{path}.{path} = 1", f"{path} = [{{{path} = [1]}}]", f"[[{path}]]\n{path} = 1"):
        tables = parse_toml(text)
        assert parse_toml(toml_document(tables)) == tables
    for text in (f"[{path}]\nb.{path} = 1", f"{path} = [[{{b.{path} = [1]}}]]"):
        with pytest.raises(TomlError, match="nested too deeply: at most 8 tables"):
            parse_toml(text)
