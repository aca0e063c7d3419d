"""Set-up files of OpenSim's static optimization: what they ask for, and OpenSim's own results."""

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.cli import main

from ..make_opensim import ASKED
from ..opensim_static import simplified
from ..own_models import FOLDER, SETUP, STATIC, static_files


@pytest.fixture
def write(tmp_path):
    """Writes the files of a set-up, some of it in other words, and returns its file."""

    def written(*others, **asked):
        for name, text in static_files(**asked).items():
            for old, new in others if name == STATIC else ():
                assert old in text
                text = text.replace(old, new)
            (tmp_path / name).write_text(text)
        return tmp_path / STATIC

    return written


def load(*given, **changes):
    return em.opensim.load_setup(*given, **changes)


# -- What is asked for ----------------------------------------------------------------------------


def test_a_setup(write, tmp_path):
    setup = load(write())
    assert isinstance(setup, em.opensim.StaticSetup)
    assert setup.name == "blocks" and setup.results_directory == tmp_path / "results"
    assert setup.model.muscles.names == ("left", "right", "own", "wider")
    assert setup.model.reserves == (em.Reserve("slide", 1.0, name="reserve"),)
    assert (setup.motion.start, setup.motion.end) == (0.1, 0.6)
    assert [each.name for each in setup.coordinates] == ["slide"]
    settings = setup.settings
    assert settings.step == pytest.approx(0.01)  # two of the file's
    assert settings.normalizer == em.RigidTendonForce()
    assert settings.criterion == em.SquaredForces()
    assert not settings.control_limits  # the muscles' own, 0.01 to 1


def test_its_times_from_arguments(write):
    setup = load(write(), initial_time=0.2, final_time=0.3)
    assert (setup.motion.start, setup.motion.end) == (0.2, 0.3)


@pytest.mark.parametrize(("interval", "step"), [(1, 0.005), (3, 0.0075), (10, 0.01)])
def test_windows_are_intervals_or_equal_parts_of_them(interval, step, write):
    file = write(("<step_interval>2<", f"<step_interval>{interval}<"))
    assert load(file, final_time=0.55).settings.step == pytest.approx(step)
    if interval == 3:
        with pytest.warns(em.SpanWarning, match="the last 5 ms of the span are less than a window"):
            load(file)


def test_an_interval_that_is_no_number_of_samples(write):
    for text in ("0", "1.5"):
        with pytest.raises(em.ModelFileError, match=f"step_interval: {text} is no number of"):
            load(write(("<step_interval>2<", f"<step_interval>{text}<")))


def test_the_exponent_and_what_forces_are_divided_by(write):
    assert load(write(activation_exponent=3)).settings.criterion == em.PoweredForces(3.0)
    for asked, taken in ((1, em.SquaredForces()), (12, em.PoweredForces(10.0))):
        with pytest.warns(em.ModelFileWarning, match=f"activation_exponent: {asked}: here it is"):
            assert load(write(activation_exponent=asked)).settings.criterion == taken
    setup = load(write(use_muscle_physiology="false"))
    assert setup.settings.normalizer == em.MaximumIsometricForce()


def test_without_the_models_forces_it_is_inverse_dynamics(write):
    setup = load(write(use_model_force_set="false"))
    assert len(setup.model.muscles) == 0
    assert setup.model.reserves[1:] == (em.Reserve("slide", 1.0, name="slide_actuator"),)
    result = em.static_optimization(setup.model, setup.motion, settings=setup.settings)
    skeleton = setup.model.skeleton
    with skeleton.opened():
        for k in (0, 17, 50):
            t = result.time[k]
            q, v, a = setup.motion(t)
            M, bias, _ = skeleton.dynamics_at(q, v, t)
            np.testing.assert_allclose(result.reserves[k].sum(), M @ a + bias, rtol=1e-9)


def test_the_low_pass_is_of_sixth_order(write):
    low_pass = (
        "<lowpass_cutoff_frequency_for_coordinates>8</lowpass_cutoff_frequency_for_coordinates>"
    )
    motion = load(write(("<coordinates_file>", f"{low_pass}<coordinates_file>"))).motion
    t = np.arange(0, 0.8, 0.005)
    expected = em.Motion.from_samples(
        t, 0.03 * np.sin(7.0 * t), cutoff=8.0, low_pass=em.LowPass.BUTTERWORTH_6
    )
    for mine, theirs in zip(motion(0.4), expected(0.4), strict=True):
        np.testing.assert_allclose(mine, theirs, rtol=1e-9)


def test_states_in_place_of_coordinates(write):
    file = write(("coordinates_file>", "states_file>"))
    assert load(file).motion(0.4)[0] == pytest.approx(0.03 * np.sin(2.8), abs=1e-12)
    speeds = "<speeds_file>speeds.sto</speeds_file><coordinates_file>"
    with pytest.warns(em.ModelFileWarning, match="speeds are those of the coordinates here"):
        load(write(("<coordinates_file>", speeds)))


def test_what_is_none_is_refused(write):
    with pytest.raises(em.ModelFileError, match="only a StaticOptimization that is on can be run"):
        load(write(("<on>true", "<on>false")))
    other = "<JointReaction name='loads'/><StaticOptimization "
    assert load(write(("<StaticOptimization ", other))).name == "blocks"
    second = "<StaticOptimization name='b'/></objects></AnalysisSet>"
    with pytest.warns(em.ModelFileWarning, match="only the first StaticOptimization is run"):
        load(write(("</objects></AnalysisSet>", second)))


# -- OpenSim's results ----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def stored():
    with np.load(FOLDER / "static_optimizations.npz") as arrays:
        return dict(arrays)


@pytest.mark.filterwarnings("ignore::exudyn_muscles.ModelFileWarning")
@pytest.mark.parametrize("name", ASKED)
def test_opensims_problem_has_opensims_solution(name, write, stored):
    """With rigid tendons and neither passive forces nor activation dynamics. Of Millard's muscles
    OpenSim takes another fibre's pennation for what they can do."""
    setup = load(write(**ASKED[name]))
    activation, force = (stored[f"{name}_{kind}"] for kind in ("activation", "force"))
    assert stored[f"{name}_force_labels"].tolist()[1:5] == list(setup.model.muscles.names)
    found = simplified(setup, np.clip(activation[:, 0], 0.1, 0.6), passive=False)
    tolerance = 5e-8 if name == "isometric" else 1e-3
    np.testing.assert_allclose(found.activation, activation[:, 1:5], rtol=0, atol=tolerance)
    within = np.array([tolerance, 300 * tolerance, 0.01, 300 * tolerance])
    assert (np.abs(found.force - force[:, 1:5]) < within).all()


def test_without_physiology_the_whole_result_is_opensims(write, stored):
    """Muscles are tensions of F0 times their activation there."""
    setup = load(write(use_muscle_physiology="false"))
    result = em.static_optimization(setup.model, setup.motion, settings=setup.settings)
    assert result.max_unmet_torque == 0.0
    times = stored["isometric_activation"][:, 0]
    rows = [int(np.abs(result.time - t).argmin()) for t in times]
    np.testing.assert_allclose(result.time[rows], times, rtol=0, atol=1e-9)
    for kind, found, scale in (
        ("activation", result.activations, 1.0), ("force", result.tendon_forces, 1000.0)
    ):  # fmt: skip
        expected = stored[f"isometric_{kind}"][:, 1:5]
        np.testing.assert_allclose(found[rows], expected, rtol=0, atol=1e-7 * scale)


@pytest.mark.filterwarnings("ignore::exudyn_muscles.ModelFileWarning")
@pytest.mark.parametrize("name", ["squares", "cubes"])
def test_what_the_whole_result_adds(name, write, stored):
    """Passive forces most of all: these muscles are long. Tendons that stretch take a quarter of
    that back."""
    setup = load(write(**ASKED[name]))
    result = em.static_optimization(setup.model, setup.motion, settings=setup.settings)
    assert result.max_unmet_torque == 0.0
    times = np.clip(stored[f"{name}_force"][:, 0], 0.1, 0.6)
    passive = simplified(setup, times, passive=True).force
    whole = np.column_stack([np.interp(times, result.time, x) for x in result.tendon_forces.T])
    added = np.sqrt(np.mean((passive - stored[f"{name}_force"][:, 1:5]) ** 2))
    taken = np.sqrt(np.mean((passive - whole) ** 2))
    assert 110.0 < added < 125.0 and 0.2 * added < taken < 0.3 * added


# -- The command ----------------------------------------------------------------------------------


def test_the_command(write, tmp_path, capsys):
    file = write()
    assert main(["static", str(file), "--final-time", "0.2", "--quiet", "--no-figures"]) == 0
    assert "blocks, Static: complete, t = 0.1 to 0.2 s, 10 steps" in capsys.readouterr().out
    states = em.read_storage(tmp_path / "results" / "blocks_static_states.sto")
    assert "/forceset/left/activation" in states.labels
    assert main(["cmc", str(file)]) == 2
    assert "a static optimization is run by exudyn-muscles static" in capsys.readouterr().err
    assert main(["static", str(tmp_path / SETUP)]) == 2
    assert "a set-up of CMC is run by exudyn-muscles cmc" in capsys.readouterr().err
