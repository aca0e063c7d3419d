"""Passive forces against OpenSim's, in Exudyn's own runs, and what is refused."""

from contextlib import nullcontext

import exudyn as exu
import numpy as np
import pytest

import exudyn_muscles as em

from ..own_models import FOLDER
from ..runs import settings
from . import passive_models


def load(tmp_path, text):
    file = tmp_path / "model.osim"
    file.write_text(text)
    return em.opensim.load_model(file)


@pytest.fixture(scope="module")
def numbers():
    with np.load(FOLDER / "passive.npz") as stored:
        return dict(stored)


STRAIGHT = [name for name in passive_models.FORCES if name != "wrapped"]


@pytest.mark.parametrize("name", STRAIGHT)
def test_forces_are_opensims(name, tmp_path, numbers):
    """As Exudyn has them in Q: the difference that the force makes there."""
    found = []
    for text in (passive_models.model(), passive_models.model(name)):
        model = load(tmp_path, text)
        at = [list(numbers["names"]).index(each) for each in model.coordinates]
        with model.skeleton.opened():
            rows = []
            for q, u in zip(numbers["q"], numbers["u"], strict=True):
                rows.append(model.skeleton.dynamics_at(q[at], u[at], 0.0).bias)
        found.append(np.array(rows))
    force = found[0] - found[1]
    expected = numbers[name][:, at]
    assert np.abs(expected).max() > 0.1
    np.testing.assert_allclose(force, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


def run(model, q, u, step):
    """The end of a run of Exudyn's own from q, u: the model's muscles are no part of it."""
    model.mbs.systemData.SetODE2Coordinates(q, configuration=exu.ConfigurationType.Initial)
    model.mbs.systemData.SetODE2Coordinates_t(u, configuration=exu.ConfigurationType.Initial)
    model.mbs.SolveDynamic(
        settings(step, end=passive_models.SPAN), solverType=exu.DynamicSolverType.TrapezoidalIndex2
    )
    return model.mbs.systemData.GetODE2Coordinates()


@pytest.mark.parametrize("name", STRAIGHT)
def test_exudyns_own_runs_have_them(name, tmp_path, numbers):
    """Its steps leave an error of second order: what they agree on is OpenSim's end."""
    model = load(tmp_path, passive_models.model(name))
    at = [list(numbers["names"]).index(each) for each in model.coordinates]
    ends = [run(model, numbers["q"][0][at], numbers["u"][0][at], step) for step in (1e-4, 5e-5)]
    expected = numbers[f"{name}_end"][at]
    assert np.abs(ends[1] - expected).max() < 1e-5
    # A contact that opens leaves an error of its own.
    rest = 5e-6 if "contact" in name or "crossley" in name else 1e-7
    assert np.abs((4.0 * ends[1] - ends[0]) / 3.0 - expected).max() < rest


CONSERVATIVE = ("path_spring", "ligament", "blankevoort", "wrapped", "two_points", "bushing")


@pytest.mark.parametrize("name", CONSERVATIVE)
def test_forces_at_rest_come_from_an_energy(name, tmp_path, numbers):
    """Their slopes over the coordinates are symmetric."""
    model = load(tmp_path, passive_models.model(name))
    at = [list(numbers["names"]).index(each) for each in model.coordinates]
    q, e = numbers["q"][2][at], 1e-5
    with model.skeleton.opened():

        def force(q):
            return model.skeleton.dynamics_at(q, np.zeros(len(q)), 0.0).bias

        slopes = np.array([(force(q + e * x) - force(q - e * x)) / (2 * e) for x in np.eye(len(q))])
    assert np.abs(slopes).max() > 10.0
    np.testing.assert_allclose(slopes, slopes.T, rtol=0, atol=1e-6 * np.abs(slopes).max())


def test_forces_may_be_among_the_components(tmp_path):
    """As OpenSim's Moco examples have their contact: surfaces and forces beside the sets."""
    text = passive_models.model("smooth_contact")
    contact = passive_models.FORCES["smooth_contact"].replace("/contactgeometryset/", "/")
    surfaces = passive_models.SURFACES.removeprefix("<ContactGeometrySet><objects>")
    moved = text.replace(passive_models.FORCES["smooth_contact"], "").replace(
        passive_models.SURFACES, ""
    )
    beside = surfaces.removesuffix("</objects></ContactGeometrySet>").strip() + contact
    moved = moved.replace("</Model>", f"<components>{beside}</components></Model>")
    found = []
    for each in (text, moved):
        model = load(tmp_path, each)
        with model.skeleton.opened():
            found.append(model.skeleton.dynamics_at(np.full(6, 0.01), np.zeros(6), 0.0).bias)
    np.testing.assert_array_equal(*found)
    assert np.abs(found[0]).max() > 100.0


def test_of_two_contact_geometries_of_one_name_the_first_counts(tmp_path):
    text = passive_models.model("smooth_contact")
    other = text.replace("</objects></ContactGeometrySet>", (
        '<ContactSphere name="heel"><socket_frame>/ground</socket_frame><radius>0.2</radius>'
        "</ContactSphere></objects></ContactGeometrySet>"
    ))  # fmt: skip
    found = []
    for each in (text, other):
        warned = pytest.warns(em.ModelFileWarning, match="the first one counts")
        with warned if each is other else nullcontext():
            model = load(tmp_path, each)
        with model.skeleton.opened():
            found.append(model.skeleton.dynamics_at(np.full(6, 0.01), np.zeros(6), 0.0).bias)
    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize(("version", "is_on"), [("30000", False), ("40000", True)])
def test_disabled_forces_are_on_in_files_that_no_longer_say_it_so(version, is_on, tmp_path):
    """As in OpenSim, which renames the property in older files only."""
    text = passive_models.model("spring").replace('Version="40000"', f'Version="{version}"')
    off = text.replace("<stiffness>12", "<isDisabled>true</isDisabled><stiffness>12")
    warned = pytest.warns(em.ModelFileWarning, match="does not read this in files of version 4")
    found = []
    for each in (text, off):
        with warned if is_on and each is off else nullcontext():
            model = load(tmp_path, each)
        with model.skeleton.opened():
            found.append(model.skeleton.dynamics_at(np.full(6, 0.3), np.zeros(6), 0.0).bias)
    assert np.array_equal(*found) == is_on


def test_one_file_is_no_sequence_of_force_sets(tmp_path):
    file = tmp_path / "model.osim"
    file.write_text(passive_models.model())
    with pytest.raises(em.ParameterError, match=r"a sequence of files, got 'reserves\.xml' alone"):
        em.opensim.load_model(file, force_sets="reserves.xml")


def test_an_actuator_between_points_is_opensims(tmp_path, numbers):
    """A positive control pushes the points apart, within the file's limits of it."""
    text = passive_models.model().replace(
        "<ForceSet><objects>", f"<ForceSet><objects>{passive_models.PUSHING}"
    )
    model = load(tmp_path, text)
    at = [list(numbers["names"]).index(each) for each in model.coordinates]
    (actuator,) = model.reserves
    assert (actuator.min_control, actuator.max_control, actuator.optimal_force) == (-1.0, 3.0, 7.0)
    for q, expected in zip(numbers["q"][:, at], numbers["pushing"][:, at], strict=True):
        found = model.geometry(q, np.zeros(len(q))).columns[:, 0]
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8 * np.abs(expected).max())
    assert np.abs(numbers["pushing"]).max() > 0.05


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<bodyB>shank", "<points_are_global>true</points_are_global><bodyB>shank",
         "points_are_global: this cannot be represented"),
        ("<bodyA>foot", "<bodyA>hand", "there is no frame 'hand'"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_an_actuator_between_points(old, new, message, tmp_path):
    pushing = passive_models.PUSHING.replace(old, new)
    text = passive_models.model().replace("<ForceSet><objects>", f"<ForceSet><objects>{pushing}")
    with pytest.raises(em.ModelFileError, match=message):
        load(tmp_path, text)
