"""`coverable warm-up`: its commands, and the messages that name it."""

import numba

import feasibility.checking
from feasibility import notices
from feasibility.cli.main import _parser, main
from feasibility.cli.warm_up import COMMANDS


def test_every_command_of_a_warm_up_is_one():
    for _, arguments in COMMANDS:  # all of it: make campaign NAME=warm_up
        assert _parser().parse_args(arguments).command == arguments[0]


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
