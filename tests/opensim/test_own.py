"""This project's own models and files as OpenSim 4.6 runs and writes them: control, tables, and the
command line."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles import cli

from ..cli.test_commands import PENDULUM
from ..conftest import pytest_terminal_summary
from ..make_opensim import noisy
from ..opensim import ABSENT
from ..opensim_models import load, path_of
from ..own_models import FOLDER, SETUP, cmc_files

# RMS of what differs from OpenSim's states, twice what it is: [m], [m/s], [1], [m].
TOLERANCES = {"value": 6e-4, "speed": 5e-3, "activation": 0.03, "fiber_length": 6e-4}


@pytest.fixture(scope="module")
def setup(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cmc")
    for name, text in cmc_files().items():
        (folder / name).write_text(text)
    return em.opensim.load_setup(folder / SETUP)


@pytest.fixture(scope="module")
def runs(setup):
    model, motion = setup.model, setup.motion
    shifted = dataclasses.replace(setup.settings, prediction=em.Prediction.SHIFTED)
    return {
        "cmc": em.computed_muscle_control(model, motion, settings=setup.settings),
        "shifted": em.computed_muscle_control(model, motion, settings=shifted),
        "csf": em.cosimulate(model, motion, settings=setup.cosimulation(em.Scheme.FULL)),
    }


def test_states_of_control_are_opensims(runs):
    with np.load(FOLDER / "cmc.npz") as stored:
        labels, states = stored["states_labels"].tolist(), stored["states"]
    assert len(labels) == 1 + 2 + 2 * 4
    for result in runs.values():
        assert result.max_unmet_torque == 0.0
        for label, column in zip(labels[1:], states.T[1:], strict=True):
            name, what = label.split("/")[-2:]
            if what in ("value", "speed"):
                mine = {"value": result.coordinates, "speed": result.speeds}[what][:, 0]
            else:
                rows = result.activations if what == "activation" else result.fiber_lengths
                mine = rows[:, result.muscle_names.index(name)]
            difference = np.interp(states[:, 0], result.time, mine) - column
            assert np.sqrt(np.mean(difference**2)) < TOLERANCES[what], label


def test_control_tracks_better_than_opensims(runs):
    with np.load(FOLDER / "cmc.npz") as stored:
        theirs = np.sqrt(np.mean(stored["errors"][:, 1] ** 2))
    assert 2e-4 < theirs < 3e-4
    bounds = {"cmc": 0.06, "shifted": 0.3, "csf": 0.08}  # twice what it is
    for name, result in runs.items():
        assert result.tracking_error_rms()[0] < bounds[name] * theirs


def test_files_as_opensim_writes_them_now_and_did_before():
    t, samples = noisy()
    now, before = (em.read_storage(FOLDER / f"noisy.{ending}") for ending in ("sto", "mot"))
    assert (now.name, now.in_degrees) == ("", False)
    assert (before.name, before.in_degrees) == ("noisy", True)
    np.testing.assert_allclose(now.time, t, rtol=0, atol=1e-15)
    np.testing.assert_allclose(now.coordinates(["one"], ["rad"])[:, 0], samples[:, 0], rtol=1e-14)
    np.testing.assert_allclose(now.values[:, 1], samples[:, 1], rtol=1e-14)
    # Eight decimals, in degrees as it says.
    found = before.coordinates(["one", "two"], ["rad", "m"])
    np.testing.assert_allclose(np.degrees(found[:, 0]), samples[:, 0], rtol=0, atol=6e-9)
    np.testing.assert_allclose(found[:, 1], samples[:, 1], rtol=0, atol=6e-9)


def test_the_command_takes_a_model_and_a_motion_of_opensim(tmp_path, capsys):
    model = load("arm")
    t = np.linspace(0.0, 0.3, 61)
    swing = np.degrees([0.1, 0.1, 0.4, 0.8]) + np.sin(4.0 * t)[:, None]
    file = tmp_path / "swing.mot"
    em.Storage("swing", model.coordinates, t, swing, in_degrees=True).write(file)
    arguments = ["run", str(path_of("arm")), "--method", "csf", "--out", str(tmp_path)]
    motion = ["--motion", str(file), "--cutoff", "12"]
    # Its two muscles cannot do that: a run that has lost the motion is no success.
    assert cli.main([*arguments, *motion]) == 2
    printed = capsys.readouterr()
    assert "RMS tracking error: yaw " in printed.out and "arm, CSF: lost" in printed.out
    assert "error: CSF has lost the motion: elbow: off" in printed.err
    stored = em.Trajectory.load(tmp_path / "arm_csf.npz")
    assert stored.coordinate_names == ("yaw", "roll", "pitch", "elbow")
    assert cli.main(arguments) == 2
    assert "a model file of OpenSim needs --motion FILE.mot" in capsys.readouterr().err
    assert cli.main(["run", str(PENDULUM), "--method", "csf", *motion]) == 2
    assert "--motion, --cutoff and --angles belong to an .osim file" in capsys.readouterr().err


def test_tests_that_are_left_out_are_counted():
    lines, skipped = [], [SimpleNamespace(longrepr=("file", 1, f"Skipped: {ABSENT}"))] * 3
    other = SimpleNamespace(longrepr=("file", 1, "Skipped: no pandas"))
    for reports in ([*skipped, other], [other]):
        pytest_terminal_summary(
            SimpleNamespace(stats={"skipped": reports}, write_line=lines.append)
        )
    (line,) = lines
    assert line.startswith("3 tests were skipped because ") and "is absent" in line


@pytest.mark.parametrize("method", ["cmc", "csf", "css"])
def test_the_command_runs_a_setup(method, tmp_path, capsys):
    for name, text in cmc_files().items():
        (tmp_path / name).write_text(text)
    options = ["--method", method, "--final-time", "0.1"]
    assert cli.main(["cmc", str(tmp_path / SETUP), *options]) == 0
    assert f"blocks, {method.upper()}: complete, t = 0 to 0.1 s" in capsys.readouterr().out
    controls = em.read_storage(tmp_path / "results" / f"blocks_{method}_controls.sto")
    assert controls.labels == ("left", "right", "own", "wider", "reserve")
