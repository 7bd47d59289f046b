"""Roll, pitch and yaw as a rotation."""

import math

import numpy as np
from scipy.spatial.transform import Rotation

from robots.mounting import about_fixed_axes


def test_the_rotation_is_that_of_scipy_to_the_last_bit() -> None:
    rng = np.random.default_rng(0)
    angles = [*rng.uniform(-7.0, 7.0, (200, 3))]
    right = np.array([0.0, 0.5 * math.pi, -0.5 * math.pi, math.pi, -math.pi])
    angles += [*rng.choice(right, (50, 3))]
    for rpy in angles:
        expected = Rotation.from_euler("xyz", rpy).as_matrix()
        np.testing.assert_array_equal(about_fixed_axes(*rpy.tolist()), expected)
