"""Boxes in which the tool can nowhere be on the surface: two tests of linear models, and cuts.

A model says that every place of a box where the constraints hold is c + d with

    |v_g + (C d)_g| <= R_g  for each group g of coordinates,    low <= d <= high:         (1)

the three of the tool point, the three of its axis, and one for each end of a limited range of the
roll. **Lemma.** For every vector w, split into the same groups, (1) gives
|w . (v + C d)| <= sum_g |w_g| R_g. *Proof.* Cauchy and Schwarz in every group. QED

*Contraction:* that is an interval for a sum of intervals, so each d_j lies in the interval that the
others leave. *Separation:* where w . (v + C d) > sum_g |w_g| R_g for all d in the box, the box
holds nothing. The w that separates best is v + C d cut down by R_g in every group, at the d that
makes it shortest; coordinate descent finds that roughly, and any w is right. NaN separates nothing.

Open boxes are cut into smaller ones, and nothing is lost: along what can move the tool furthest
from, or along, the surface, a joint is halved, or the part of the surface gives way to its
children. The finest parts are halved along x.

*Joints of a turn and more.* Turns of 2 pi leave the tool where it is. So where the question is
whether a region holds any configuration with the tool on the surface, a joint whose interval holds
a whole turn may take any one turn of it. That makes joints without limits finite.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.certification.cut_proofs.linear_models import Boxes, Models, Parts

SWEEPS = 2  # of the coordinate descent
STEEPEST = 3  # columns of which the pairwise cross products are tried as directions
PAD = 1e-12  # [rad], [m], [1] by which contracted intervals are widened
TINY = 1e-300
KEPT = 0.7  # share of a box's width, in its shortest joint, over which contraction is no progress
FEW = 100  # boxes: so few are cut several times at once, as none of them will be proved empty yet
TIMES = 3
TURN = 2.0 * np.pi


def group_lengths(vectors: Array) -> Array:
    """(..., 2 + k) lengths of the groups of vectors (..., 6 + k)."""
    squares = vectors[..., :6] ** 2
    lengths = np.sqrt(squares[..., 0::3] + squares[..., 1::3] + squares[..., 2::3])
    return np.concatenate([lengths, np.abs(vectors[..., 6:])], axis=-1)


def nearest(models: Models, sweeps: int = SWEEPS) -> tuple[Array, Array]:
    """Places d (m, n + 2) in the boxes where the constraints are missed by little, and by what.

    Returns:
        d, and the excess (m, 6 + k) there: v + C d, each group cut down by its radius.
    """
    # Coordinates come first here: numpy's loops then run over the boxes.
    columns = np.ascontiguousarray(models.columns.transpose(1, 2, 0))
    radius = np.ascontiguousarray(models.radius.T)
    low, high = np.ascontiguousarray(models.low.T), np.ascontiguousarray(models.high.T)
    place = np.clip(0.0, low, high)
    values = models.residual.T + np.einsum("jm,jkm->km", place, columns)
    per_square = -1.0 / np.maximum((columns**2).sum(axis=1), TINY)
    for _ in range(sweeps):
        for j in range(len(columns)):
            step = np.einsum("km,km->m", columns[j], excess(values, radius)) * per_square[j]
            moved = np.minimum(np.maximum(place[j] + step, low[j]), high[j])
            values += (moved - place[j]) * columns[j]
            place[j] = moved
    return place.T, excess(values, radius).T


def excess(values: Array, radius: Array) -> Array:
    """What is left of values (6 + k, m) when each group is cut down by its radius (2 + k, m)."""
    three = values[:6].reshape(2, 3, -1)
    lengths = np.sqrt(np.einsum("gkm,gkm->gm", three, three))
    share = np.maximum(1.0 - radius[:2] / np.maximum(lengths, TINY), 0.0)
    left = np.empty_like(values)
    np.multiply(three, share[:, None], out=left[:6].reshape(2, 3, -1))
    if len(values) > 6:
        sums = values[6:]
        left[6:] = np.sign(sums) * np.maximum(np.abs(sums) - radius[2:], 0.0)
    return left


def separated(models: Models, w: Array) -> Mask:
    """(m,) boxes that directions w (m, 6 + k) prove empty."""
    slopes = np.einsum("mjk,mk->mj", models.columns, w)
    least = (models.residual * w).sum(axis=1)
    least = least + np.minimum(slopes * models.low, slopes * models.high).sum(axis=1)
    return np.asarray(least > (group_lengths(w) * models.radius).sum(axis=1))


def contract(models: Models, directions: Array) -> tuple[Array, Array]:
    """The intervals of d that directions (m, r, 6 + k) leave.

    Returns:
        low, high (m, n + 2); low > high somewhere where nothing is left.
    """
    low, high = models.low.copy(), models.high.copy()
    all_slopes = directions @ models.columns.transpose(0, 2, 1)
    offsets = np.einsum("mrk,mk->mr", directions, models.residual)
    bounds = (group_lengths(directions) * models.radius[:, None]).sum(axis=2)
    for r in range(directions.shape[1]):
        slopes = all_slopes[:, r]
        first, second = slopes * low, slopes * high
        least, most = np.minimum(first, second), np.maximum(first, second)
        # slopes_j d_j is at most bound - offset - (the least that the others can be), and so on
        ceiling = (bounds[:, r] - offsets[:, r] - least.sum(axis=1))[:, None] + least
        floor = (-bounds[:, r] - offsets[:, r] - most.sum(axis=1))[:, None] + most
        steep = np.abs(slopes) > 1e-12
        over = np.where(steep, slopes, 1.0)
        a, b = floor / over, ceiling / over
        low = np.where(steep, np.maximum(low, np.minimum(a, b) - PAD), low)
        high = np.where(steep, np.minimum(high, np.maximum(a, b) + PAD), high)
    return low, high


def directions_for(models: Models, normals: Array) -> Array:
    """(m, r, 6 + k) directions that contract well.

    Besides the coordinates and the surface's normals (m, 3): the residuals' own, and those along
    which two of the columns that matter most have no effect.
    """
    m, n, width = models.columns.shape
    matter = np.linalg.norm(models.columns[..., :3], axis=2) * (models.high - models.low)
    chosen = np.argsort(-matter, axis=1)[:, : min(STEEPEST, n)]
    top = np.take_along_axis(models.columns[..., :3], chosen[..., None], axis=1)
    first, second = np.triu_indices(top.shape[1], 1)
    crossed = np.cross(top[:, first], top[:, second])
    points = np.concatenate([normals[:, None], models.residual[:, None, :3], crossed], axis=1)
    found = np.zeros((m, points.shape[1] + 1 + width, width))
    found[:, : points.shape[1], :3] = points
    found[:, points.shape[1], 3:6] = models.residual[:, 3:6]
    found[:, points.shape[1] + 1 :] = np.eye(width)
    lengths = np.linalg.norm(found, axis=2, keepdims=True)
    return np.asarray(found / np.maximum(lengths, TINY))


def smaller(boxes: Boxes, models: Models, parts: Parts, length: float) -> Boxes:
    """What contraction left of open boxes: as it is where it did much, otherwise cut.

    Their models are contracted; differences of axes are multiplied by `length` (m).
    """
    centre = boxes.centre
    low = np.maximum(centre + models.low, boxes.low)
    high = np.minimum(centre + models.high, boxes.high)
    width = np.maximum(boxes.high - boxes.low, TINY)
    share = np.where(boxes.high > boxes.low, (high - low) / width, 1.0)
    much = share.min(axis=1) < KEPT
    now = Boxes(low, high, boxes.part, boxes.claim)
    rest, reach = now.of(~much), models.reach[~much]
    for _ in range(TIMES if len(boxes) < FEW else 1):
        rest, reach = cut(rest, reach, parts, length)
    return Boxes.join(now.of(much), rest)


def cut(boxes: Boxes, reach: Array, parts: Parts, length: float) -> tuple[Boxes, Array]:
    """Every box in two, or in the one of these that it lies in; and the reach of these.

    The reach (m, n + 2) m is how much each variable can move the tool or the target, about.
    Differences of normals are multiplied by `length` (m).
    """
    n = reach.shape[1] - 2
    over_surface = reach[:, n:].sum(axis=1) + parts.radius[boxes.part] @ [1.0, length]
    finest = parts.children[boxes.part, 0] < 0
    surface_first = over_surface > reach[:, :n].max(axis=1)
    surface_first &= ~finest | (reach[:, n:] > 0.0).any(axis=1)
    along = np.where(
        surface_first, n + np.argmax(reach[:, n:], axis=1), np.argmax(reach[:, :n], axis=1)
    )
    to_children = surface_first & ~finest  # the others are halved
    (halved,), (split,) = np.nonzero(~to_children), np.nonzero(to_children)
    rows = np.concatenate([halved, halved, split, split])
    side = np.repeat([0, 1, 0, 1], [len(halved)] * 2 + [len(split)] * 2)
    made, reach, child = boxes.of(rows), reach[rows], to_children[rows]
    low, high, k = made.low, made.high, np.arange(2 * len(halved))
    at = k, along[rows[k]]
    middle = 0.5 * (low[at] + high[at])
    low[at] = np.where(side[k] == 1, middle, low[at])
    high[at] = np.where(side[k] == 0, middle, high[at])
    reach[at] *= 0.5
    axis = np.where(child, parts.axis[made.part], 2)
    for a in (0, 1):
        own = axis == a
        shift = np.array([1.0, -1.0])[side[own]]
        for ends in (low, high):
            ends[own, n + a] = 2.0 * ends[own, n + a] + shift
        reach[own, n + a] *= 0.5
    low[axis < 0, n:], high[axis < 0, n:] = -1.0, 1.0
    reach[axis < 0, n:] *= 0.7
    low[:, n:], high[:, n:] = np.maximum(low[:, n:], -1.0), np.minimum(high[:, n:], 1.0)
    made.part[child] = parts.children[made.part, side][child]
    kept = np.asarray(~(child & (low > high).any(axis=1)))
    return made.of(kept), reach[kept]


@dataclass(frozen=True, eq=False, slots=True)
class JointRegion:
    """Joints inside a box."""

    low: Array
    """(n,) rad or m; -inf where there is no limit."""
    high: Array
    """(n,)"""

    def within(self, joint: int, least: float, most: float) -> JointRegion:
        """The part of it in which a joint lies in least .. most."""
        low, high = self.low.copy(), self.high.copy()
        low[joint], high[joint] = max(low[joint], least), min(high[joint], most)
        return JointRegion(low, high)

    @property
    def empty(self) -> bool:
        """Does it hold no configuration?"""
        return bool((self.low > self.high).any())

    def folded(self, prismatic: Mask) -> JointRegion:
        """One turn of each joint whose interval holds one."""
        turns = ~prismatic & (self.high - self.low > TURN)
        low = np.where(turns, np.where(np.isfinite(self.low), self.low, -np.pi), self.low)
        return JointRegion(low, np.where(turns, low + TURN, self.high))
