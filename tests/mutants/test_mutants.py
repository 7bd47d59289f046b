"""The list of small faults keeps up with the code: each can still be put in, exactly once."""

from collections import Counter

import pytest
from mutants import Mutant, mutants


def test_every_fault_of_the_list_can_be_put_in() -> None:
    every = mutants()
    assert [fault for one in every for fault in one.faults()] == []
    assert max(Counter((one.file, one.old, one.new) for one in every).values()) == 1
    assert len(every) >= 120


@pytest.mark.parametrize(("file", "old", "said"), [
    ("no/such.py", "a", "no such file"),
    ("feasibility/cone.py", "no such line", "0 times"), ("feasibility/cone.py", "math", "times"),
    ("feasibility/cone.py", "2.0 * math.sin(0.5 * cone)", ""),
])  # fmt: skip
def test_an_edit_that_does_not_match_once_is_refused(file, old, said) -> None:
    faults = list(Mutant("a room", file, old, "b", "words", ()).faults())
    assert len(faults) == bool(said)
    assert said in "".join(faults)
