"""`python -m feasibility.cli`: the command `coverable`."""

from coverable.command import run

run()
