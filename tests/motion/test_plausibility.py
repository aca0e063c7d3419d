"""Warnings before a run: angles that cannot be radians, locked coordinates that move."""

import re
import warnings

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.cli import main
from models import leg, pendulum, planar_arm

from ..opensim.test_setup import FLEXOR, TIMES, motion
from ..opensim_files import JOINT, LOCKED, coordinates, write_model

T = np.linspace(0.0, 2.0, 401)
PHASE = 2.0 * np.pi * T
# Angles in degrees, as people record them.
DEGREES = {
    "elbow": 70.0 - 50.0 * np.cos(PHASE),
    "reaching": np.interp(T, [0.0, 0.5, 2.0], [0.0, 120.0, 120.0]),
    "knee in gait": -30.0 + 30.0 * np.cos(PHASE),
    "hip in gait": 10.0 + 20.0 * np.sin(PHASE),
    "held": np.full(T.size, 90.0),
    "slow": 30.0 + 5.0 * T,
    "upside down": 180.0 + 60.0 * np.sin(PHASE),
}
# And in radians, fast and far ones among them.
RADIANS = {
    **{name: np.radians(x) for name, x in DEGREES.items()},
    "crank, ten turns": 2.0 * np.pi * 5.0 * T,
    "crank, ten turns back from half a turn": np.pi - 2.0 * np.pi * 5.0 * T,
    "crank, an hour of it": 2.0 * np.pi * 5400.0 * T,  # T in half hours
    "throw, 130 rad/s": 1.5 * np.tanh((T - 1.0) * 87.0),
    "somersault and a half, and back": 3.0 * np.pi * np.sin(0.5 * PHASE),
    "tremor, 10 Hz": 0.5 + 0.02 * np.sin(10.0 * PHASE),
    "pirouettes": 2.0 * np.pi * 3.0 * np.minimum(T, 1.5),
}


RADIANS_OF_T = 0.3 * np.sin(4.0 * T)


def storage_file(folder, columns, in_degrees=False):
    storage = em.Storage("x", tuple(columns), T, np.column_stack([*columns.values()]), in_degrees)
    storage.write(folder / "motion.sto")
    return folder / "motion.sto"


def doubts(call, *arguments, **options):
    """The texts of the warnings."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call(*arguments, **options)
    assert all(each.category is em.MotionWarning for each in caught)
    return [str(each.message) for each in caught]


@pytest.mark.parametrize("name", DEGREES)
def test_degrees_in_a_file_without_a_word(name, tmp_path):
    x, label = DEGREES[name], "r_elbow_flex"
    file = storage_file(tmp_path, {"other": 0.1 * T, label: x})
    (text,) = doubts(em.Motion.from_file, file, ["other", label], ["rad", "rad"])
    assert text.startswith(f"{file}: coordinate 'r_elbow_flex' runs from {x.min():.4g} to ")
    assert f"{x.max():.4g} rad" in text
    assert "turns" in text and "are these degrees?" in text and "inDegrees=yes" in text
    # A length may have any value, and degrees that are said to be are converted.
    assert doubts(em.Motion.from_file, file, ["other", label], ["rad", "m"]) == []
    file = storage_file(tmp_path, {"other": 0.1 * T, label: x}, in_degrees=True)
    assert doubts(em.Motion.from_file, file, ["other", label], ["rad", "rad"]) == []


@pytest.mark.parametrize("name", RADIANS)
def test_radians_are_no_degrees(name, tmp_path):
    t = 1800.0 * T if "hour" in name else T
    storage = em.Storage("x", ("angle",), t, RADIANS[name][:, None])
    storage.write(tmp_path / "motion.sto")
    file = tmp_path / "motion.sto"
    assert doubts(em.Motion.from_file, file, ["angle"], ["rad"]) == []


def described(low, high, name="angle", **changes):
    usual = {"default_value": 0.0, "default_speed": 0.0, "clamped": False, "locked": False}
    return em.opensim.Coordinate(name, range=(low, high), **usual | changes)


@pytest.mark.parametrize(
    ("amplitude", "low", "high", "doubtful"),
    [
        (5.0, -0.35, 0.35, True),  # small angles, too
        (0.5, -0.35, 0.35, False),  # a careless range
        (1.2, -0.1, 0.1, True),
        (0.9, 0.0, 0.0, False),
        (2.0, -1.0, 1.0, False),
        (10.0, 0.0, 2.6, True),
        (12.0, -99999.9, 99999.9, False),  # no range to speak of
        (80.0, -99999.9, 99999.9, True),
    ],
)
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_the_models_range_tells(amplitude, low, high, doubtful, sign, tmp_path):
    if sign < 0.0:
        low, high = -high, -low
    file = storage_file(tmp_path, {"angle": sign * amplitude * np.sin(0.5 * PHASE) ** 2})
    texts = doubts(em.Motion.from_file, file, ["angle"], ["rad"], described=[described(low, high)])
    assert len(texts) == doubtful
    if doubtful and high < 10.0:
        assert f"far beyond its range of [{low:.4g}, {high:.4g}] rad" in texts[0]


def test_what_can_only_be_degrees_is_asked_back(tmp_path):
    """Until somebody says what they are."""
    x = 80.0 * np.sin(0.5 * PHASE) ** 2
    file, known = storage_file(tmp_path, {"angle": x}), [described(0.0, 2.6)]
    with pytest.raises(em.MotionError, match=r"'angle' runs from 0 to 80, .*are these degrees\?"):
        em.Motion.from_file(file, ["angle"], ["rad"], described=known)
    for in_degrees, unit in ((True, np.pi / 180.0), (False, 1.0)):
        motion = em.Motion.from_file(
            file, ["angle"], ["rad"], described=known, in_degrees=in_degrees
        )
        np.testing.assert_allclose(motion(T)[0][:, 0], unit * x, rtol=0, atol=1e-9)


def test_a_row_that_was_doubled_by_rounding(tmp_path):
    """Two rows at almost one time are one: a spline through both would leap."""
    t, x = np.append(T[:50], T[49:] + 1e-8), np.append(RADIANS_OF_T[:50], RADIANS_OF_T[49:])
    t[51:] -= 1e-8
    x[50] += 1e-7
    em.Storage("x", ("angle",), t, x[:, None]).write(tmp_path / "motion.sto")
    found = em.Motion.from_file(tmp_path / "motion.sto", ["angle"], ["rad"])
    expected = em.Motion.from_samples(T, RADIANS_OF_T)
    np.testing.assert_allclose(found(T)[2], expected(T)[2], rtol=0, atol=0.05)


@pytest.mark.parametrize(
    ("rotates", "in_degrees", "x", "said"),
    [
        (True, False, 0.3 + 0.2 * np.sin(PHASE), "from 0.1 to 0.5 rad"),
        (True, True, np.degrees(0.3 + 0.2 * np.sin(PHASE)), "from 0.1 to 0.5 rad"),
        (False, True, 0.3 + 0.2 * np.sin(PHASE), "from 0.1 to 0.5 m"),
        (True, False, np.zeros(T.size), "from 0 to 0 rad"),  # held elsewhere
        (True, False, 0.3 + 1e-5 * np.sin(PHASE), None),
        (True, True, np.full(T.size, np.degrees(0.3)), None),
    ],
)
def test_a_locked_coordinate_that_moves(rotates, in_degrees, x, said, tmp_path):
    file = storage_file(tmp_path, {"angle": 0.1 * T, "subtalar": x}, in_degrees)
    locked = described(-1.5, 1.2, "subtalar", default_value=0.3, locked=True, rotates=rotates)
    unlocked = described(-1.5, 1.2, "subtalar", default_value=0.3)
    absent = described(-1.0, 1.0, "absent", default_value=5.0, locked=True)
    known = [described(-1.0, 1.0), locked, absent]
    texts = doubts(em.Motion.from_file, file, ["angle"], ["rad"], described=known)
    assert len(texts) == (said is not None)
    if said:
        assert texts[0].startswith(f"{file}: coordinate 'subtalar' runs {said}")
        unit = "rad" if rotates else "m"
        assert f"holds it at 0.3 {unit}: it is locked; its range is [-1.5, 1.2] {unit}" in texts[0]
    assert doubts(em.Motion.from_file, file, ["angle"], ["rad"], described=[unlocked]) == []


# -- before a run, whatever the motion is from -----------------------------------------------------


def runs(model, motion):
    yield em.static_optimization, (model, motion), {}
    yield em.CMCPlugin, (model, motion), {}
    yield em.CosimulationPlugin, (model, motion), {}


@pytest.mark.parametrize("number", range(3))
def test_way_points_in_degrees(number):
    """The message is there although the run cannot go well."""
    model = pendulum.build()
    motion = em.Motion.from_waypoints([0.0, 0.5, 1.0], [180.0, 120.0, 180.0])
    call, arguments, options = list(runs(model, motion))[number]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call(*arguments, **options)
    texts = [str(each.message) for each in caught if each.category is em.MotionWarning]
    assert len(texts) == 1 and "'theta' runs from 120 to 180 rad" in texts[0]
    assert "np.radians converts them" in texts[0]


@pytest.mark.parametrize("source", [pendulum, planar_arm, leg])
def test_the_models_own_motions(source):
    model, motion = source.build(), source.motion()
    for call, arguments, options in list(runs(model, motion))[1:]:
        assert doubts(call, *arguments, **options) == []


def test_a_file_is_told_of_once(tmp_path):
    """When it is read, also of a part of it."""
    model = pendulum.build()
    file = storage_file(tmp_path, {"theta": 180.0 + 60.0 * np.sin(PHASE)})
    with pytest.warns(em.MotionWarning):
        motion = em.Motion.from_file(file, ["theta"], ["rad"])
    assert motion.source == motion.between(0.0, 1.0).source == str(file)
    assert em.Motion.from_waypoints([0.0, 1.0], [0.0, 1.0]).source is None
    assert doubts(em.CosimulationPlugin, model, motion.between(0.0, 1.0)) == []


# -- from the command line and in set-ups ----------------------------------------------------------

RANGE = "<range>-1.5 1.5</range>"


def write_small_model(folder):
    """A shoulder with a range, and a locked elbow."""
    inside = coordinates("shoulder", inside=RANGE) + coordinates("elbow", inside=LOCKED + RANGE)
    joints = JOINT.format(kind="UniversalJoint", coordinates=inside, inside="")
    return write_model(folder / "model.osim", joints=joints, forces=FLEXOR)


def test_what_a_model_file_says_of_its_coordinates(tmp_path):
    shoulder, elbow = em.opensim.read_coordinates(write_small_model(tmp_path))
    joint = {"joint": "/jointset/joint"}
    assert shoulder == described(-1.5, 1.5, "shoulder", **joint)
    assert elbow == described(-1.5, 1.5, "elbow", default_value=0.3, locked=True, **joint)
    joints = JOINT.format(kind="SliderJoint", coordinates=coordinates("way"), inside="")
    (way,) = em.opensim.read_coordinates(write_model(tmp_path / "slider.osim", joints=joints))
    assert not way.rotates


@pytest.mark.parametrize("wrong", ["degrees", "locked"])
def test_the_command_line_says_so(wrong, tmp_path, capsys):
    """A small angle in degrees, which only its range betrays."""
    model, x = write_small_model(tmp_path), 0.1 * np.sin(4.0 * TIMES)
    elbow = x if wrong == "locked" else np.full(TIMES.size, 0.3)
    columns = ("shoulder", np.degrees(x) if wrong == "degrees" else x), ("elbow", elbow)
    file = tmp_path / "motion.mot"
    file.write_text(motion(*columns, degrees=False))
    main(["run", str(model), "--method", "static", "--motion", str(file)])
    said = re.sub(r"\s+", " ", capsys.readouterr().err)
    text = {
        "degrees": "coordinate 'shoulder' runs from 0 to 5.73 rad, far beyond its range of "
        "[-1.5, 1.5] rad: are these degrees?",
        "locked": "coordinate 'elbow' runs from 0 to 0.1 rad, but the model holds it at "
        "0.3 rad: it is locked; its range is [-1.5, 1.5] rad",
    }[wrong]
    assert text in said
    assert said.count("coordinate '") == 1
