"""`python -m coverable`: the command `coverable`."""

from coverable.command import run

run()
