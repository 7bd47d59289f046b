"""`coverable warm-up`: afterwards no command compiles, and messages name it."""

import json

import numba
from numba.core import event

import feasibility.checking
from feasibility import notices
from feasibility.cli.main import main

COMMANDS = (
    ("check", "paper/4b", "--json"),
    ("explain", "paper/4a", "--set", "collision.clearance=0.01", "--set", "surface.cells=[2, 2]"),
    ("path", "paper/5d", "--passes", "90", "--pitch", "0.2"),
    ("divide", "paper/4f"),
)


def test_after_a_warm_up_nothing_is_compiled(ask):
    status, out, err = ask("warm-up", "--json")
    assert (status, err) == (0, "")
    assert json.loads(out)["compiled"] >= 0
    with event.install_recorder("numba:compile") as recorded:
        assert {ask(*command)[0] for command in COMMANDS} <= {0, 1, 3}
        assert recorded.buffer == []
        assert ask("warm-up")[1] == "everything is compiled already\n"


def test_who_waits_is_told_for_what_and_how_to_have_it_all_at_once(capsys, monkeypatch):
    real = feasibility.checking.check

    def compiling(*args, **more):
        numba.njit(lambda x: x + 1)(1)
        return real(*args, **more)

    monkeypatch.setattr(feasibility.checking, "check", compiling)
    monkeypatch.setattr(notices, "PATIENCE", 0.0)
    assert main(["check", "paper/4a", "--set", "surface.cells=[2, 2]"]) == 0
    err = capsys.readouterr().err
    assert "what else `coverable check` needs" in err
    assert "`coverable warm-up` compiles all" in err
