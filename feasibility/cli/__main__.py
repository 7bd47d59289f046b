"""`python -m feasibility.cli`: the command `coverable`."""

from coverable_command import run

run()
