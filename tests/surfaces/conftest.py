"""Patches and a motion that tests of meshes run on."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from specimens import SMOOTH


@pytest.fixture(params=[*SMOOTH][:10], ids=str)
def patch(request):
    """One patch after the other."""
    return SMOOTH[request.param]


@pytest.fixture
def motion():
    """A rigid motion x -> rotation x + translation."""
    turn = 2.3 * np.array([1.0, -2.0, 0.5]) / np.sqrt(5.25)
    return Rotation.from_rotvec(turn).as_matrix(), np.array([4.0, -3.0, 2.0])
