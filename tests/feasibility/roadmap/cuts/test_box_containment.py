"""What contraction keeps of boxes around known points of the motion set: the points."""

import numpy as np
import pytest
from box_containment import ARMS, KINDS, known_point, loses


@pytest.mark.parametrize("arm", ARMS)
def test_no_box_loses_a_known_point(arm):
    """Six kinds of surfaces, 25 boxes each; tolerance and cone are used up to 0.1 percent.

    The campaign cut_boxes has many more.
    """
    rng = np.random.default_rng(sum(arm.encode()))
    for kind in KINDS:
        known = known_point(arm, kind, rng)
        assert not any(loses(known, rng) for _ in range(25)), kind


def test_a_wrong_bound_would_be_found():
    """With a smaller tolerance than the point needs, boxes lose it."""
    rng = np.random.default_rng(3)
    known = known_point("puma560", "sphere", rng)
    tight = known._replace(arrays=known.arrays._replace(tolerance=0.5 * known.arrays.tolerance))
    finest = known.places.radius[known.parts, 0].argmin()
    tight = tight._replace(
        parts=known.parts[[finest]],
        x=known.x[[finest]],
        places=known.places._replace(radius=np.zeros_like(known.places.radius)),
    )
    assert any(loses(tight, rng) for _ in range(60))
