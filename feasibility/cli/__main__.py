"""`python -m feasibility.cli`: the command `coverable`."""

from feasibility.cli.main import run

run()
