"""Files that OpenSim replays: what is in them, and what OpenSim makes of them where it is there."""

import dataclasses
import importlib.util

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.results.excitations import EDGE

from ..benchmarks.replay_in_opensim import replayed
from ..opensim_models import path_of

states_of, controls_of = em.opensim.result_files.states, em.opensim.result_files.controls
needs_opensim = pytest.mark.skipif(
    importlib.util.find_spec("opensim") is None, reason="OpenSim's Python package is absent"
)
RESERVES = """<OpenSimDocument Version="40000"><ForceSet name="reserves"><objects>
<CoordinateActuator name="hip_reserve"><coordinate>hip_angle</coordinate>
<optimal_force>20</optimal_force></CoordinateActuator>
<PointActuator name="FY"><body>pelvis</body><point>-0.07 0 0</point><direction>0 1 0</direction>
<point_is_global>false</point_is_global><force_is_global>true</force_is_global>
<optimal_force>100</optimal_force></PointActuator></objects></ForceSet></OpenSimDocument>"""


def run(file, forces, **settings):
    """A leg with a coupled patella, whose muscles, reserve and residual change in every window."""
    model = em.opensim.load_model(file, force_sets=forces)
    q = np.array([{"hip_angle": 0.3, "knee_angle": -0.2, "up": 0.95}.get(name, 0.0)
                  for name in model.coordinates])  # fmt: skip
    model.skeleton.set_initial_state(q, np.zeros(q.size))
    rng, t = np.random.default_rng(4), np.arange(9) * 0.01
    u = rng.uniform(0.02, 0.2, size=(8, len(model.muscles)))
    reserves = np.column_stack([rng.uniform(-5.0, 5.0, 9), 230.0 + rng.uniform(-20.0, 20.0, 9)])
    given = em.Excitations(t, u, reserves)
    return model, em.forward_dynamics(model, given, settings=em.ForwardSettings(**settings))


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("leg")
    (folder / "reserves.xml").write_text(RESERVES)
    (folder / "leg.osim").write_text(path_of("leg").read_text())
    locked = '<Coordinate name="tilt"><locked>true</locked><default_value>0.2</default_value>'
    text = path_of("leg").read_text()
    (folder / "locked.osim").write_text(text.replace('<Coordinate name="tilt">', locked, 1))
    return folder


@pytest.mark.parametrize("name", ["leg", "locked"])
def test_states_have_every_coordinate_of_the_model(files, name):
    file = files / f"{name}.osim"
    model, result = run(file, [files / "reserves.xml"])
    described = em.opensim.read_coordinates(file)
    states = states_of(result, model, described)
    joints = {
        "tilt": "root", "forward": "root", "up": "root", "hip_angle": "hip", "knee_angle": "knee",
        "patella_angle": "patella", "ankle_angle": "ankle",
    }  # fmt: skip
    paths = [f"/jointset/{joint}/{of}" for of, joint in joints.items()]
    assert sorted(states.labels[:14]) == sorted(
        f"{path}/{x}" for path in paths for x in ("value", "speed")
    )
    muscles = [f"/forceset/{x}" for x in model.muscles.names]
    assert states.labels[14:] == tuple(
        f"{path}/{x}" for path in muscles for x in ("activation", "fiber_length")
    )
    column = dict(zip(states.labels, states.values.T, strict=True))
    for x in ("value", "speed"):  # by its coupler the patella's is the knee's
        knee = column[f"/jointset/knee/knee_angle/{x}"]
        np.testing.assert_array_equal(column[f"/jointset/patella/patella_angle/{x}"], knee)
    assert np.abs(knee).max() > 0.1
    if name == "locked":
        assert "tilt" not in model.coordinates
        assert (column["/jointset/root/tilt/value"] == 0.2).all()
        assert (column["/jointset/root/tilt/speed"] == 0.0).all()
    read = states.coordinates(model.coordinates, model.skeleton.units)
    np.testing.assert_array_equal(read, result.coordinates)


def test_states_leave_out_what_rigid_tendons_have_not(files):
    model, result = run(files / "leg.osim", [files / "reserves.xml"])
    stiff = [
        dataclasses.replace(muscle, ignore_tendon_compliance=muscle.name == "calf")
        for muscle in model.muscles
    ]
    rebuilt = em.MusculoskeletalModel(
        model.mbs, 0, stiff, coordinates=model.skeleton.tree_coordinates,
        dependent_coordinates=model.dependent_coordinates, reserves=model.reserves,
    )  # fmt: skip
    labels = states_of(result, rebuilt).labels
    assert "/forceset/calf/activation" in labels and "/forceset/calf/fiber_length" not in labels
    assert "/forceset/shin/fiber_length" in labels
    assert "patella_angle/value" in labels  # as the model has it; nobody said in which joint


def test_states_of_something_else_are_refused(files, tmp_path):
    model, result = run(files / "leg.osim", [files / "reserves.xml"])
    fewer = dataclasses.replace(result, muscle_names=result.muscle_names[:-1])
    with pytest.raises(em.StorageError, match="the model has others"):
        states_of(fewer, model)
    other = em.opensim.Coordinate("toes", 0.0, 0.0, (-1.0, 1.0), False, False)
    with pytest.raises(em.StorageError, match="coordinate 'toes' is none of the model's"):
        states_of(result, model, [other])


def test_read_linearly_controls_are_held_and_reserves_are_not(files, tmp_path):
    model, result = run(files / "leg.osim", [files / "reserves.xml"])
    controls = controls_of(result, model.reserves)
    assert controls.labels == (*model.muscles.names, "hip_reserve", "FY")
    t, u = result.window_time, result.excitation_values
    inside = np.sort(np.random.default_rng(2).uniform(t[0], t[-1], 400))
    inside = inside[np.abs(inside[:, None] - t).min(axis=1) > 2.0 * EDGE]
    read = [np.interp(inside, controls.time, column) for column in controls.values.T]
    np.testing.assert_array_equal(np.array(read[:-2]).T, u[np.searchsorted(t, inside) - 1])
    for k, size in enumerate((20.0, 100.0)):
        expected = np.interp(inside, t, result.reserves[:, k]) / size
        np.testing.assert_allclose(read[k - 2], expected, rtol=0, atol=1e-6)
    # And back again, to the bit but for the optimal forces.
    controls.write(tmp_path / "controls.sto")
    again = em.Excitations.from_file(tmp_path / "controls.sto", model.muscles.names, model.reserves)
    np.testing.assert_array_equal(again.time, t)
    np.testing.assert_array_equal(again.values, u)
    np.testing.assert_allclose(again.reserves, result.reserves, rtol=1e-15)


@needs_opensim
@pytest.mark.parametrize("name", ["leg", "locked"])
def test_opensim_replays_the_motion(files, name):
    """A coupled patella and a locked pelvis among the coordinates; a step of 0.1 ms here."""
    file = files / f"{name}.osim"
    model, result = run(file, [files / "reserves.xml"], step=1e-4)
    described = em.opensim.read_coordinates(file)
    found = replayed(result, model, described, file, ["reserves.xml"])
    assert len(found) == 7
    assert np.ptp(result.coordinates, axis=0).max() > 0.1
    assert result.coordinates[:, model.coordinates.index("knee_angle")].min() > -0.6  # no jump
    for each in found.values():
        assert np.abs(each["differences"]).max() < 1e-5
