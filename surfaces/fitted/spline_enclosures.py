"""Splines and NURBS over boxes of parameters: control points hold everything between them.

Over one span a spline is a polynomial, whose coefficients in Bernstein's basis over any box follow
from its control points. The normal is along S_u x S_v, which is a polynomial too, or for a rational
spline S = A / w along

    w A_u x A_v + w_v A x A_u + w_u A_v x A,

w^3 times it. A is seen from a point of the box itself, so that nothing cancels.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from coverable.arrays import Array
from surfaces import bernstein
from surfaces.enclosures import Enclosure

ORDERS = ((0, 0), (1, 0), (0, 1))
SMALLEST = 1e-300


class SpanNets:
    """A spline as polynomials over its spans, with its first derivatives."""

    def __init__(
        self,
        points: Array,
        weights: Array | None,
        knots: tuple[Array, Array],
        degree: tuple[int, int],
        breaks: tuple[Array, Array],
    ) -> None:
        """See `SplineMap` for the arguments, all but `breaks`: where its smooth spans end."""
        self.breaks = breaks
        self.middle = points.mean(axis=(0, 1))
        net = points - self.middle
        if weights is not None:
            net = np.concatenate([weights[..., None] * net, weights[..., None]], axis=-1)
        by_u, by_v = (
            [bernstein.span_matrix(knots[axis], degree[axis], *ends) for ends in pairwise(line)]
            for axis, line in enumerate(breaks)
        )
        p, q = degree
        nets = np.array(
            [
                [
                    np.einsum("ab,cd,bdx->acx", a, c, net[i : i + p + 1, j : j + q + 1])
                    for j, c in by_v
                ]
                for i, a in by_u
            ]
        )
        width = [np.diff(line) / (line[-1] - line[0]) for line in breaks]
        self.nets = {
            (0, 0): nets,
            (1, 0): p * np.diff(nets, axis=2) / width[0][:, None, None, None, None],
            (0, 1): q * np.diff(nets, axis=3) / width[1][:, None, None, None],
        }

    def over(self, u: Enclosure, v: Enclosure) -> tuple[Enclosure, Enclosure]:
        """Points and normals over boxes that each lie in one span."""
        made = self._made(u, v)
        if made[0].shape[1] == 3:
            points, along, across = made
            return points + self.middle, unit(np.cross(along, across))
        origin, (a, w), (a_u, w_u), (a_v, w_v) = _seen_from_inside(made)
        normal = w * np.cross(a_u, a_v) + w_v * np.cross(a, a_u) + w_u * np.cross(a_v, a)
        return a / w + (origin + self.middle), unit(normal)

    def tangents_over(self, u: Enclosure, v: Enclosure) -> Enclosure:
        """Unit vectors along S_u; or w A_u - A w_u."""
        made = self._made(u, v)
        if made[0].shape[1] == 3:
            return unit(made[1])
        _, (a, w), (a_u, w_u), _ = _seen_from_inside(made)
        return unit(a_u * w - a * w_u)

    def _made(self, u: Enclosure, v: Enclosure) -> list[Enclosure]:
        """S, S_u and S_v, or A with w and their derivatives."""
        spans, shares = [], []
        for axis, x in enumerate((u, v)):
            line = self.breaks[axis]
            low, high = x.net.reshape(2, -1)
            at = np.clip(np.searchsorted(line, (low + high) / 2.0, "right") - 1, 0, len(line) - 2)
            begin, width = line[at], line[at + 1] - line[at]
            spans.append(at)
            shares.append([np.clip((end - begin) / width, 0.0, 1.0) for end in (low, high)])
        made = []
        for order in ORDERS:
            net = self.nets[order][spans[0], spans[1]]
            k, m, n, d = net.shape
            by_u, by_v = (
                bernstein.part_matrices(size - 1, *share)
                for size, share in zip((m, n), shares, strict=True)
            )
            net = by_v[:, None] @ (by_u @ net.reshape(k, m, n * d)).reshape(k, m, n, d)
            made.append(Enclosure(net.transpose(1, 2, 0, 3)))
        return made


def _seen_from_inside(made: list[Enclosure]) -> tuple[Any, ...]:
    """An origin (k, 3) in each box, and A from there beside w, and their derivatives."""
    low, high = made[0].ends
    origin = (low + high)[:, :3] / (low + high)[:, 3:]
    return origin, *((part[:, :3] - part[:, 3:] * origin, part[:, 3:]) for part in made)


def unit(vectors: Any) -> Any:
    """At length 1.

    First at 1 along the mean of their directions, along which one of them at least leads: what
    lengths differ by cancels in quotients, as it would not where a root is one of the factors.
    """
    lengths = np.linalg.norm(vectors.net, axis=-1, keepdims=True)
    middle = (vectors.net / np.maximum(lengths, SMALLEST)).mean(axis=(0, 1))
    vectors = vectors / (vectors * middle).sum(axis=-1, keepdims=True)
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
