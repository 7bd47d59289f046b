"""100,000 random boxes around known points of the motion set, none of which loses its point."""

import numpy as np
import pytest
from box_containment import ARMS, KINDS, known_point, loses

POINTS, BOXES = 14, 200  # of each arm and kind of surface


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("kind", KINDS)
def test_no_box_loses_a_known_point(arm, kind):
    rng = np.random.default_rng([sum(arm.encode()), sum(kind.encode())])
    for _ in range(POINTS):
        known = known_point(arm, kind, rng)
        assert not any(loses(known, rng) for _ in range(BOXES))
