"""Results of two methods that several files look at."""

import pytest

import exudyn_muscles as em
from models import pendulum, planar_arm

from ..runs import KP


@pytest.fixture(scope="module")
def csf():
    return em.cosimulate(
        pendulum.build(),
        pendulum.motion(),
        settings=em.CosimulationSettings(scheme=em.Scheme.FULL, kp=KP),
    )


@pytest.fixture(scope="module")
def cmc():
    return em.computed_muscle_control(
        planar_arm.build(), planar_arm.motion(), settings=em.CMCSettings(kp=KP)
    )
