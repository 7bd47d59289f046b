"""After `coverable warm-up` no command compiles."""

import json

from numba.core import event

from feasibility.cli.main import main

COMMANDS = (
    ("check", "paper/4b", "--json"),
    ("explain", "paper/4a", "--set", "collision.clearance=0.01", "--set", "surface.cells=[2, 2]"),
    ("path", "paper/5d", "--passes", "90", "--pitch", "0.2"),
    ("divide", "paper/4f"),
)


def test_after_a_warm_up_nothing_is_compiled(capsys):
    assert main(["warm-up", "--json"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert json.loads(out)["compiled"] >= 0
    with event.install_recorder("numba:compile") as recorded:
        assert {main(list(command)) for command in COMMANDS} <= {0, 1, 3}
        assert recorded.buffer == []
        capsys.readouterr()
        assert main(["warm-up"]) == 0
        assert capsys.readouterr().out == "everything is compiled already\n"
