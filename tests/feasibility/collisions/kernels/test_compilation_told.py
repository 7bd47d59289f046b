"""Clocks stand still, and people are told, while the C function of the clearance is compiled."""

from __future__ import annotations

from typing import Any

from numba import njit
from numba.core import event

from feasibility.collisions.kernels.calls import _WholeCompilation


class Depth(event.Listener):  # type: ignore[misc]
    """How many compilations go on: what a clock counts."""

    def __init__(self) -> None:
        self.now, self.most = 0, 0

    def on_start(self, about: Any) -> None:
        self.now += 1
        self.most = max(self.most, self.now)

    def on_end(self, about: Any) -> None:
        self.now -= 1


def test_it_goes_on_from_the_first_kernel_until_the_function_is_there() -> None:
    @njit
    def kernel(x: float) -> float:
        return x + 1.0

    whole, depth = _WholeCompilation(), Depth()
    with event.install_listener("numba:compile", depth):
        with event.install_listener("numba:compile", whole):
            assert kernel(1.0) == 2.0
        assert depth.now == 1  # the kernel is there, the function is not
        whole.end()
        assert depth.now == 0


def test_what_is_loaded_is_no_compilation() -> None:
    whole, depth = _WholeCompilation(), Depth()
    with event.install_listener("numba:compile", depth):
        whole.end()
    assert depth.most == 0
