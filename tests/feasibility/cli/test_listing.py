"""`coverable keys`: the whole reference, one table of it, and names that there are not."""

import json

import pytest

from feasibility.cases import all_keys
from feasibility.cli import main as cli


@pytest.fixture
def ask(capsys):
    """Run the command in this process: ask(arguments) -> status, stdout, stderr."""

    def asked(*args):
        status = cli.main(list(args))
        out, err = capsys.readouterr()
        return status, out, err

    return asked


def test_keys_prints_each_key_with_type_unit_default_and_meaning(ask):
    status, out, err = ask("keys")
    assert (status, err) == (0, "")
    for key in all_keys():
        for text in (key.written, key.type, key.unit, key.default or "needed", key.meaning):
            assert text in out


@pytest.mark.parametrize(
    ("asked", "wanted"),
    [
        ("task", lambda key: key.table == "task"),
        ("surface", lambda key: key.table.startswith("surface")),
        ("surface.cut", lambda key: key.table == "surface.cut"),
        ("mesh", lambda key: key.kind == "mesh"),
        ("surface.mesh", lambda key: key.kind == "mesh"),
    ],
)
def test_keys_of_one_table_or_kind(ask, asked, wanted):
    status, out, _ = ask("keys", asked, "--json")
    rows = json.loads(out)["keys"]
    assert status == 0
    expected = [
        {"table": key.table, "kind": key.kind or None, "key": key.name, "type": key.type,
         "unit": key.unit or None, "default": key.default, "meaning": key.meaning,
         "example": key.example}
        for key in all_keys() if wanted(key)
    ]  # fmt: skip
    assert rows == expected != []


@pytest.mark.parametrize(
    ("asked", "words"), [("serach", '"search"'), ("?", "robot, surface"), ("", "robot, surface")]
)
def test_keys_of_a_table_that_there_is_not(ask, asked, words):
    status, out, err = ask("keys", asked)
    assert (status, out) == (2, "")
    assert words in err
