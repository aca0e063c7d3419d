"""Lengths, lengthening speeds and moment arms of OpenSim 4.6's models."""

import json

import numpy as np
import pytest

from ..differences import gradient
from ..opensim import REFERENCE, needs_opensim_files
from ..opensim_paths import OpenSimPaths

pytestmark = needs_opensim_files


class Reference:
    def __init__(self, name):
        self.names = json.loads((REFERENCE / f"{name}_static.json").read_text())
        self.data = np.load(REFERENCE / f"{name}_static.npz")
        self.ours = OpenSimPaths(name, self.names["coordinates"])
        states = zip(self.data["q"], self.data["u"], strict=True)
        self.l, self.l_t, self.r = map(
            np.array, zip(*(self.ours.evaluate(q, u) for q, u in states), strict=True)
        )

    def muscle(self, name):
        return self.names["muscles"].index(name)


@pytest.fixture(scope="module")
def leg():
    return Reference("leg6dof9musc")


@pytest.fixture(scope="module")
def arm():
    return Reference("arm26")


def test_conditional_and_moving_points(leg):
    """A knee that slides while it turns, points that come, go and move."""
    np.testing.assert_allclose(leg.l, leg.data["L"], rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(leg.l_t, leg.data["V"], rtol=0.0, atol=1e-12)
    # OpenSim gives the knee's arm a second time, with the patella as the coordinate.
    own = [k for k, name in enumerate(leg.names["coordinates"]) if name != "knee_angle_pat_r"]
    np.testing.assert_allclose(leg.r[..., own], leg.data["R"][..., own], rtol=0.0, atol=1e-12)
    for q, points in zip(leg.data["q"], leg.data["npts"], strict=True):
        assert [len(found) for found in leg.ours.points(q)] == points.tolist()


def test_straight(arm):
    i = arm.muscle("BICshort")
    np.testing.assert_allclose(arm.l[:, i], arm.data["L"][:, i], rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(arm.l_t[:, i], arm.data["V"][:, i], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(arm.r[:, i], arm.data["R"][:, i], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "longer"), [("TRIlat", 1.3e-6), ("TRImed", 1.3e-6), ("BRA", 3e-5)]
)
def test_cylinder(arm, name, longer):
    """A helix is the shortest way. OpenSim's tangent points are a little off it, and so its muscles
    are longer, by more in a steep helix."""
    i = arm.muscle(name)
    difference = arm.data["L"][:, i] - arm.l[:, i]
    assert difference.min() > -1e-13
    assert difference.max() < longer


def test_cylinder_of_a_muscle_with_several(arm):
    """With more than one surface OpenSim makes the muscle tangent, within 0.1 deg."""
    i = arm.muscle("TRIlong")
    alone = [2, 5, 6, 7, 8, 15]  # states in which the cylinder at the elbow is all that it touches
    difference = arm.data["L"][alone, i] - arm.l[alone, i]
    assert -1e-13 < difference.min() <= difference.max() < 1e-8


def test_ellipsoid(arm):
    i = arm.muscle("BIClong")
    np.testing.assert_allclose(arm.l[:, i], arm.data["L"][:, i], rtol=0.0, atol=5e-6)
    assert (arm.data["npts"][:, i] == 11).sum() >= 10


def test_ellipsoid_and_cylinder_in_one_segment(arm):
    """OpenSim's way over the ellipsoid is none of the shortest here, and up to 6 mm longer."""
    i = arm.muscle("TRIlong")
    difference = arm.data["L"][:, i] - arm.l[:, i]
    assert difference.min() > -1e-6
    assert difference.max() < 6e-3


def test_moment_arms_are_minus_dl_dq(arm):
    for q, r in zip(arm.data["q"], arm.r, strict=True):
        slopes = gradient(lambda x: arm.ours.evaluate(x, np.zeros(2))[0], q, 1e-4)
        np.testing.assert_allclose(r, -slopes, rtol=0.0, atol=1e-9)
