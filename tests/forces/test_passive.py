"""Formulas, and passive forces on trees of Exudyn's own: what they say of wrong input."""

import math

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import InertiaCylinder, TreeLink
from hypothesis import given
from hypothesis import strategies as st

import exudyn_muscles as em
from exudyn_muscles.forces.passive.along_paths import BlankevoortLigament, Ligament, PathSpring
from exudyn_muscles.forces.passive.between_frames import Bushing
from exudyn_muscles.forces.passive.contact import SphereContact, contact_row, normal_force
from exudyn_muscles.forces.passive.expressions import STACK, pack_programs, program, run
from exudyn_muscles.forces.passive.on_coordinates import (
    CoordinateFormula,
    CoordinateLimitForce,
    CoordinateSpring,
)
from exudyn_muscles.skeleton.passive import add_passive_forces

VARIABLES = ("q", "qdot")


def value(text, **variables):
    programs = pack_programs([program("0", ()), program(text, tuple(variables))])
    return run(programs, 1, np.array([*variables.values()], dtype=float), np.empty(STACK))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2+3*4^2", 50.0),
        ("-2^2", -4.0),
        ("2^3^2", 512.0),
        ("2^-1", 0.5),
        ("(1-4)/2", -1.5),
        ("1e-3*1000", 1.0),
        ("a*b; a = 2*b; b = 3", 18.0),
        ("a; a = 100; a = 5", 100.0),
        ("2\n + 3", 5.0),
        ("select(step(0), 5, 6) + select(step(-1), 5, 6)", 11.0),
        ("delta(0) + delta(1)", 1.0),
        ("min(3, max(1, 2)) + square(3) + cube(2) + recip(4)", 19.25),
        ("sec(1)*cos(1) + csc(1)*sin(1) + cot(1)*tan(1)", 3.0),
        ("asin(sin(0.3)) + acos(cos(0.3)) + atan(tan(0.3)) + atan2(0, 1)", 0.9),
        ("cosh(1)^2 - sinh(1)^2 + tanh(0) + erf(0.4) + erfc(0.4)", 2.0),
        ("floor(1.5) + ceil(1.5) + abs(-2) + sqrt(16) + log(exp(1))", 10.0),
    ],
)
def test_formulas(text, expected):
    assert value(text) == pytest.approx(expected, rel=1e-14)


def test_what_a_formula_says_of_a_variable_counts():
    assert value("100*q; q = 5", q=1.0) == 500.0


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_formulas_of_variables(q, qdot):
    expected = -3.5 * math.exp(2.0 * (q - 0.1)) + math.tanh(qdot) * q**3
    found = value("-3.5*exp(2*(q-0.1)) + tanh(qdot)*q^3", q=q, qdot=qdot)
    assert found == pytest.approx(expected, rel=1e-13, abs=1e-13)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("q +", "is not a formula"),
        ("", "is not a formula"),
        ("q * w", "'w', which stands for nothing: q, qdot do"),
        ("a; a = a + 1", "'a', which stands for nothing"),
        ("__import__('os')", "none of its operations"),
        ("q.real", "none of its operations"),
        ("[1, 2]", "none of its operations"),
        ("sin(1, 2)", "none of its operations"),
        ("True", "none of its operations"),
        ("1e999", "has a number that is too large"),
        ("9" * 400, "has a number that is too large"),
        ("5*q # - 100*q", "is not a formula"),
        ("+".join(["1"] * 6000), "characters"),
        ("a+a;" + ";".join(f"{'abcdefghijklmnop'[k]}={'abcdefghijklmnop'[k + 1]}+"
                           f"{'abcdefghijklmnop'[k + 1]}" for k in range(15)) + ";p=1", "too long"),
        ("1+(" * 100 + "1" + ")" * 100, "nested too deeply"),
        ("(" * 5000 + "1" + ")" * 4999, "is not a formula|characters"),
    ],
)  # fmt: skip
def test_what_is_no_formula_is_said(text, message):
    with pytest.raises(em.ParameterError, match=message):
        program(text, VARIABLES)


PATH = [em.PathPoint([0.1, 0.0, 0.0]), em.PathPoint([0.0, -0.2, 0.0], link=0)]
CURVE = em.Curve(lambda x: 10.0 * (x - 1.0), (1.0, 2.0))
LIMITS = {
    "upper_limit": 1.0, "upper_stiffness": 10.0, "lower_limit": 0.0, "lower_stiffness": 10.0,
    "transition": 0.1,
}  # fmt: skip
CONTACT = {
    "sphere": 0, "half_space": -1, "center": [0, 0, 0], "radius": 0.1, "frame": np.eye(4),
    "stiffness": 1e4, "dissipation": 1.0,
}  # fmt: skip


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: CoordinateLimitForce("f", "q", **LIMITS | {"transition": 0.0}), "transition = 0"),
        (
            lambda: CoordinateLimitForce("f", "q", **LIMITS | {"upper_stiffness": -1.0}),
            "force 'f': upper_stiffness = -1.0 is outside",
        ),
        (lambda: CoordinateSpring("f", "q", stiffness=np.nan), "force 'f': stiffness = nan"),
        (lambda: CoordinateFormula("f", "q", "x"), "'x', which stands for nothing"),
        (lambda: PathSpring("f", path=PATH, resting_length=-1, stiffness=1), "resting_length = -1"),
        (
            lambda: Ligament(
                "f", path=PATH, resting_length=0.0, pcsa_force=1.0, force_length=CURVE
            ),
            "resting_length = 0.0",
        ),
        (
            lambda: BlankevoortLigament("f", path=PATH, slack_length=0.0, linear_stiffness=1.0),
            "slack_length = 0.0",
        ),
        (lambda: Bushing("f", links=(0, 1), frames=(np.eye(4),) * 2, stiffness=[1.0]), "six"),
        (lambda: SphereContact("f", **CONTACT | {"radius": 0.0}), "contact 'f': radius = 0.0"),
        (lambda: SphereContact("f", share=2.0, **CONTACT), "share = 2 is outside"),
        (
            lambda: SphereContact("f", smooth=True, other_radius=0.1, **CONTACT),
            "the smooth form is of a half-space",
        ),
    ],
)
def test_bad_numbers_are_named(make, message):
    with pytest.raises(em.ParameterError, match=message):
        make()


def tree():
    """A forearm that turns about z without gravity."""
    mbs = exu.SystemContainer().AddSystem()
    forearm = InertiaCylinder(density=1100, length=0.26, outerRadius=0.04, axis=1)
    link = TreeLink(
        jointType=exu.JointType.RevoluteZ,
        parent=-1,
        jointHT=np.eye(4),
        linkInertia=forearm.Translated([0, -0.13, 0]),
    )
    return mbs, mbs.CreateKinematicTree(listOfTreeLinks=[link], gravity=[0, 0, 0])


@pytest.mark.parametrize(
    ("force", "message"),
    [
        (CoordinateSpring("f", "x", stiffness=1.0), "force 'f': there is no coordinate 'x'"),
        (Bushing("f", links=(0, 1), frames=(np.eye(4),) * 2), "force 'f' is on link 1"),
        (SphereContact("f", **CONTACT | {"sphere": 3}), "force 'f' is on link 3"),
        (
            PathSpring("f", path=[PATH[0], em.PathPoint([0, 0, 0], 4)], resting_length=1,
                       stiffness=1),
            "force 'f': path point 1 is on link 4",
        ),
    ],
)  # fmt: skip
def test_what_the_tree_does_not_have_is_named(force, message):
    mbs, number = tree()
    with pytest.raises(em.ParameterError, match=message):
        add_passive_forces(mbs, number, [force], ["q"])


def test_a_user_function_that_is_there_is_not_replaced():
    mbs, number = tree()
    spring = CoordinateSpring("f", "q", stiffness=1.0)
    add_passive_forces(mbs, number, [spring], ["q"])
    with pytest.raises(em.ModelError, match="has a force user function already"):
        add_passive_forces(mbs, number, [spring], ["q"])


def test_smooth_contact_without_dissipation():
    """OpenSim's default: Hertz's force alone, whatever the speed."""
    contact = SphereContact("f", smooth=True, **CONTACT | {"dissipation": 0.0})
    k, d = CONTACT["stiffness"], 0.01
    hertz = 4.0 / 3.0 * k * math.sqrt(0.1 * k) * math.sqrt(d**2 + 1e-5) ** 1.5
    expected = hertz * (0.5 + 0.5 * math.tanh(300.0 * d))
    for speed in (-0.5, 0.0, 0.5):
        assert normal_force(contact_row(contact), d, speed) == pytest.approx(expected, rel=1e-14)
