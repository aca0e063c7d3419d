"""Trajectory: what it holds, and how it shows itself."""

from time import process_time

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.results.recorder import _saturated
from exudyn_muscles.skeleton.geometry import Geometry
from models import pendulum

from ..runs import KP, plugin_run, settings, start_at


def test_shapes_and_contents(csf):
    assert csf.time.shape == (101,)
    assert csf.coordinates.shape == csf.speeds.shape == csf.accelerations.shape == (101, 1)
    assert csf.activations.shape == csf.tendon_forces.shape == (101, 2)
    assert csf.tendon_lengths.shape == csf.fiber_lengths.shape == (101, 2)
    assert csf.excitation_values.shape == csf.force_max.shape == (100, 2)
    assert csf.window_time.shape == (101,)
    assert csf.settings["kp"] == KP and csf.settings["scheme"] == "FULL"
    assert csf.versions["exudyn"] and csf.versions["exudyn_muscles"]
    assert csf.cpu_time > 0.0
    assert csf.status is em.Status.COMPLETE and csf.message == ""


def test_fiber_and_tendon_make_up_the_path(csf):
    """l = l_t + l_m cos(alpha), with the tendon stretched by its force (DGF, 4.9 % at F0)."""
    f = csf.tendon_forces / 3000.0
    k_T = np.log(6.0) / 0.049
    tendon = 0.16 * (1.0 + np.log((f + 0.2) / 0.2) / k_T)
    np.testing.assert_allclose(tendon, csf.tendon_lengths, rtol=0, atol=1e-12)
    width = 0.15 * np.sin(0.1)
    along = np.sqrt(csf.fiber_lengths**2 - width**2)
    np.testing.assert_allclose(tendon + along, csf.musculotendon_lengths, rtol=0, atol=1e-12)


def test_tracking_error(csf):
    error = csf.desired_coordinates - csf.coordinates
    assert csf.tracking_error_rms() == pytest.approx(np.sqrt(np.mean(error**2, axis=0)))


def test_cpu_time_ends_with_the_run():
    model, motion = pendulum.build(), pendulum.motion().between(0.0, 0.05)
    start_at(model, motion)
    plugin = em.CosimulationPlugin(model, motion, em.CosimulationSettings(scheme=em.Scheme.FULL))
    plugin_run(model, plugin, settings(end=0.05))
    taken = plugin.result().cpu_time
    begun = process_time()
    while process_time() < begun + 0.05:
        pass
    assert plugin.result().cpu_time == taken


def test_the_saturated_muscles_are_those_that_were_at_their_limit_and_pull_the_right_way():
    """At the window where most was missing, with the arms of that instant."""
    names = ("full", "reaching", "against", "short arm")
    arms = [[[0.04], [0.04], [-0.04], [1e-6]], [[0.04], [0.04], [0.04], [1e-6]]]
    arms.append([[0.04], [0.04], [-0.04], [1e-6]])
    geometry = [Geometry(*[np.zeros(4)] * 2, np.array(each)) for each in arms]
    ends = np.array([0.1, 0.2])
    high = np.array([[100.0, 100.0, 100.0, 100.0]] * 2)
    optimal = np.array([[100.0, 80.0, 100.0, 100.0]] * 2)
    time = np.array([0.0, 0.1, 0.2])
    for missing, expected in (
        ([[0.0], [2.0]], ("full",)),
        ([[0.0], [-2.0]], ("against",)),
        ([[2.0], [1.0]], ("full", "against")),
        ([[0.0], [0.0]], ()),
    ):
        found = _saturated(names, time, ends, geometry, np.array(missing), optimal, high)
        assert found == (expected,)


def test_to_xarray(csf, tmp_path):
    whole = csf.to_xarray()
    np.testing.assert_array_equal(whole["activations"].sel(muscle="left"), csf.activations[:, 0])
    np.testing.assert_array_equal(whole["window"], csf.window_time[1:])
    assert whole["excitations"].dims == ("window", "muscle")
    assert whole["tendon_forces"].attrs["units"] == "N"
    assert whole["coordinate_unit"].item() == "rad" and whole.attrs["method"] == "csf"
    assert "reserves" not in whole  # there are none
    for name, array in whole.items():
        assert array.attrs["long_name"], name


def test_to_dataframe(csf):
    pytest.importorskip("pandas")
    frame = csf.to_dataframe()
    assert len(frame) == 101
    np.testing.assert_array_equal(frame["coordinates/theta"], csf.coordinates[:, 0])
    np.testing.assert_array_equal(frame["activations/right"], csf.activations[:, 1])
    # The excitation of a row is that of the window which ends there.
    assert frame["excitations/left"][50] == csf.excitation_values[49, 0]
    assert frame["torques_demanded/theta"][50] == csf.torques_demanded[49, 0]
    assert frame["force_max/right"][50] == csf.force_max[49, 1]


def test_a_trajectory_shows_itself_in_a_line(csf):
    assert repr(csf) == (
        "<Trajectory csf, complete: 101 points and 100 windows from 0 to 1 s, coordinates theta, "
        "muscles left, right>"
    )


def test_excitations_find_their_window(cmc):
    given = cmc.excitations
    assert given.window(0.0) == 0 and given.window(0.0051) == 0
    assert given.window(0.0101) == 1
    assert given.window(-1.0) == 0 and given.window(5.0) == 99
