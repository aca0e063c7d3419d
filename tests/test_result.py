"""Trajectory: nothing is lost on the way to a file and back; differences are named."""

import contextlib
import dataclasses
import json
from time import process_time

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.results.trajectory import _saturated
from exudyn_muscles.skeleton.geometry import Geometry
from models import pendulum, planar_arm

from .runs import KP, plugin_run, settings, start_at


@pytest.fixture(scope="module")
def csf():
    return em.cosimulate(pendulum.build(), pendulum.motion(), settings=em.Cosimulation(kp=KP))


@pytest.fixture(scope="module")
def cmc():
    return em.computed_muscle_control(
        planar_arm.build(), planar_arm.motion(), settings=em.CMC(kp=KP)
    )


def changed(trajectory, name, row, column, by):
    array = getattr(trajectory, name).copy()
    array[row, column] += by
    return dataclasses.replace(trajectory, **{name: array})


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


@pytest.mark.parametrize("which", ["csf", "cmc"])
def test_save_and_load_lose_nothing(which, request, tmp_path):
    trajectory = request.getfixturevalue(which)
    trajectory.save(tmp_path / "result.npz")
    loaded = em.Trajectory.load(tmp_path / "result.npz")
    for field in dataclasses.fields(trajectory):
        before, after = getattr(trajectory, field.name), getattr(loaded, field.name)
        if isinstance(before, np.ndarray):
            np.testing.assert_array_equal(before, after)
            assert before.dtype == after.dtype
        else:
            assert before == after, field.name
    assert loaded.compare(trajectory) is None


def test_a_forward_result_with_nan_survives_and_equals_itself(tmp_path):
    result = em.forward_dynamics(pendulum.build(), em.Excitations([0.0, 0.05], [[0.3, 0.2]]))
    assert np.isnan(result.desired_coordinates).all()
    result.save(tmp_path / "forward.npz")
    assert em.Trajectory.load(tmp_path / "forward.npz").compare(result) is None


def test_cpu_time_ends_with_the_run():
    model, motion = pendulum.build(), pendulum.motion().between(0.0, 0.05)
    start_at(model, motion)
    plugin = em.CosimulationPlugin(model, motion)
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


def test_a_truncated_file_is_refused(csf, tmp_path):
    file = tmp_path / "cut.npz"
    csf.save(file)
    content = file.read_bytes()
    for size in (0, 10, len(content) // 2, len(content) - 10):
        file.write_bytes(content[:size])
        with pytest.raises(em.ResultFileError, match=r"cut\.npz: not a readable"):
            em.Trajectory.load(file)


def test_a_file_without_an_array_is_refused(csf, tmp_path):
    csf.save(tmp_path / "whole.npz")
    with np.load(tmp_path / "whole.npz") as stored:
        rest = {name: stored[name] for name in stored.files if name != "speeds"}
    np.savez(tmp_path / "part.npz", **rest)
    with pytest.raises(em.ResultFileError, match=r"truncated, without \['speeds'\]"):
        em.Trajectory.load(tmp_path / "part.npz")


def test_another_version_is_refused(csf, tmp_path):
    csf.save(tmp_path / "now.npz")
    with np.load(tmp_path / "now.npz") as stored:
        content = {name: stored[name] for name in stored.files}
    header = json.loads(str(content.pop("header")))
    header["version"] = 99
    np.savez(tmp_path / "later.npz", header=json.dumps(header), **content)
    with pytest.raises(em.ResultFileError, match=r"version 3, found .* version 99"):
        em.Trajectory.load(tmp_path / "later.npz")


@pytest.mark.parametrize(
    "change",
    [
        lambda header, arrays: header.update(status="NONE"),
        lambda header, arrays: header.update(counts={"wheels": 4}),
        lambda header, arrays: header.update(foreign=1),
        lambda header, arrays: arrays.update(speeds=arrays["speeds"][:5]),
        lambda header, arrays: arrays.update(reserves=arrays["reserves"][:-1]),
        lambda header, arrays: arrays.update(window_time=arrays["window_time"][:3]),
        lambda header, arrays: arrays.update(start_unmet=np.zeros(5)),
        lambda header, arrays: arrays.update(excitation_values=np.array(1.0)),
        lambda header, arrays: arrays.update(coordinates=np.zeros((101, 2))),
    ],
)
def test_a_damaged_content_is_refused(csf, tmp_path, change):
    csf.save(tmp_path / "whole.npz")
    with np.load(tmp_path / "whole.npz") as stored:
        arrays = {name: stored[name] for name in stored.files}
    header = json.loads(str(arrays.pop("header")))
    change(header, arrays)
    np.savez(tmp_path / "damaged.npz", header=json.dumps(header), **arrays)
    with pytest.raises(em.ResultFileError, match=r"damaged\.npz"):
        em.Trajectory.load(tmp_path / "damaged.npz")


def test_flipped_bytes_are_refused_or_harmless(csf, tmp_path):
    csf.save(tmp_path / "whole.npz")
    content = (tmp_path / "whole.npz").read_bytes()
    generator = np.random.default_rng(0)
    for _ in range(100):
        damaged = bytearray(content)
        damaged[generator.integers(len(content))] ^= 0xFF
        (tmp_path / "flipped.npz").write_bytes(damaged)
        with contextlib.suppress(em.ResultFileError):
            em.Trajectory.load(tmp_path / "flipped.npz")


def test_a_missing_file_and_a_foreign_one(tmp_path):
    with pytest.raises(FileNotFoundError):
        em.Trajectory.load(tmp_path / "none.npz")
    np.savez(tmp_path / "foreign.npz", x=np.zeros(3))
    with pytest.raises(em.ResultFileError, match="not a readable"):
        em.Trajectory.load(tmp_path / "foreign.npz")
    (tmp_path / "text.npz").write_text("time,q\n0,1\n")
    with pytest.raises(em.ResultFileError):
        em.Trajectory.load(tmp_path / "text.npz")


def test_compare_names_quantity_time_and_size(csf):
    difference = changed(csf, "tendon_forces", 40, 1, 7.5).compare(csf)
    assert difference.quantity == "tendon_forces"
    assert difference.time == pytest.approx(0.40)
    assert difference.size == pytest.approx(7.5)
    assert str(difference).startswith("tendon_forces differ by 7.5 at t = 0.4 s, allowed is 0.2")
    # The first in time, and motion before muscles.
    two = changed(changed(csf, "tendon_forces", 40, 1, 7.5), "coordinates", 60, 0, 1e-3)
    assert two.compare(csf).quantity == "coordinates"
    window = changed(csf, "excitation_values", 10, 0, 0.1).compare(csf)
    assert (window.quantity, window.time) == ("excitations", pytest.approx(0.11))


def test_compare_with_own_tolerances(csf):
    other = changed(csf, "tendon_forces", 40, 1, 7.5)
    assert other.compare(csf, {"tendon_forces": 10.0}) is None
    with pytest.raises(em.ParameterError, match="no such quantities: \\['forces'\\]"):
        other.compare(csf, {"forces": 1.0})


def test_compare_notices_nan_names_and_shapes(csf, cmc):
    assert changed(csf, "speeds", 3, 0, np.nan).compare(csf).quantity == "speeds"
    assert csf.compare(cmc).quantity == "method"
    renamed = dataclasses.replace(csf, coordinate_names=("phi",))
    assert renamed.compare(csf).quantity == "coordinate_names"
    short = dataclasses.replace(csf, time=csf.time[:-1])
    assert short.compare(csf).quantity == "time"


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
