"""What a study is made of: sources, parameters, outcomes, samples, and what is said of those that
are not right."""

import copy
import pickle

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles import studies
from exudyn_muscles.studies.compute import compute
from exudyn_muscles.studies.identity import digest
from exudyn_muscles.studies.parameters import changed_model
from models import leg, pedalling, pendulum

from . import subjects
from .subjects import RANGES, short_motion, study


def model_of(parameters, module=leg):
    return changed_model(module.build(), parameters)


def muscle(model, name):
    return next(each for each in model.muscles if each.name == name)


# Sources


@pytest.mark.parametrize("act", [pickle.dumps, copy.copy, copy.deepcopy])
def test_a_model_says_why_it_cannot_be_pickled(act):
    with pytest.raises(em.ModelError, match=r"an Exudyn system, which cannot be pickled.*Builder"):
        act(pendulum.build())


SOURCES = {
    "by name": lambda: studies.Builder("models.pendulum:build", "models.pendulum:motion"),
    "function": lambda: studies.Builder(pendulum.build, pendulum.motion()),
    "file": lambda: studies.PythonFile(subjects.Path(pendulum.__file__)),
    "system": lambda: studies.SystemDescription.of(pendulum.build(), pendulum.motion()),
}


@pytest.mark.parametrize("source", SOURCES)
def test_a_source_builds_the_same_model_wherever_it_is(source):
    given = SOURCES[source]()
    again = pickle.loads(pickle.dumps(given))
    assert again.identity == given.identity == SOURCES[source]().identity
    results = [
        em.static_optimization(subject.model, subject.motion)
        for subject in (given.load(), again.load())
    ]
    direct = em.static_optimization(pendulum.build(), pendulum.motion())
    for result in results:
        np.testing.assert_array_equal(result.tendon_forces, direct.tendon_forces)


def test_a_description_of_the_leg_is_the_leg():
    """With dependent coordinates, and Exudyn's lists of matrices."""
    model, motion = leg.build(), leg.motion()
    there = pickle.loads(pickle.dumps(studies.SystemDescription.of(model, motion))).load()
    one, other = (em.static_optimization(x, motion) for x in (model, there.model))
    np.testing.assert_array_equal(one.tendon_forces, other.tendon_forces)
    with pytest.raises(em.StudyError, match="is built by no function with size"):
        studies.SystemDescription.of(model, motion).given({"size": 2.0})


def test_bodies_are_built_by_their_function():
    with pytest.raises(em.StudyError, match=r"use studies\.Builder"):
        studies.SystemDescription.of(pedalling.build(), pedalling.motion())


@pytest.mark.parametrize(
    ("given", "error", "text"),
    [
        (("models.pendulum", None), em.StudyError, "is no 'module:function'"),
        ((3, None), em.StudyError, "a function that builds a model was expected, got 3"),
        (("models.nothing:build", None), em.StudyError, "cannot be imported: No module"),
        (("models.pendulum:nothing", None), em.StudyError, "cannot be imported: module"),
        (("models.pendulum:motion", None), em.ModelError, "has to give a MusculoskeletalModel"),
        (("models.pendulum:build", "math:pi"), em.ModelError, "has to give a Motion, it gave flo"),
    ],
)
def test_what_is_no_builder(given, error, text):
    with pytest.raises(error, match=text):
        studies.Builder(*given).load()


def test_identities_follow_content():
    one = studies.Builder(pendulum.build, pendulum.motion, {"a": 1.0})
    assert one.identity != studies.Builder(leg.build, pendulum.motion, {"a": 1.0}).identity
    assert one.identity != studies.Builder(pendulum.build, pendulum.motion, {"a": 1.5}).identity
    assert one.identity != studies.Builder(pendulum.build, short_motion, {"a": 1.0}).identity
    assert digest(np.arange(3.0)) != digest(np.arange(3))
    assert digest({"a": 1, "b": 2}) == digest({"b": 2, "a": 1})
    assert digest(pendulum.motion()) == digest(pendulum.motion()) != digest(leg.motion())


def test_a_set_up_is_identified_by_all_files_that_it_names(tmp_path):
    (tmp_path / "inner").mkdir()
    setup, tasks = tmp_path / "setup.xml", tmp_path / "inner" / "tasks.xml"
    setup.write_text("<CMCTool><task_set_file> inner\\tasks.xml </task_set_file></CMCTool>")
    motion = tmp_path / "inner" / "ik.mot"
    tasks.write_text("<Tasks><file>ik.mot</file><again>tasks.xml</again></Tasks>")
    motion.write_text("1")
    before = studies.SetupFile(setup).identity
    motion.write_text("2")
    assert studies.SetupFile(setup).identity != before


# Parameters


def test_parameters_of_muscles():
    before = leg.build()
    model = model_of(
        {
            "soleus.tendon_slack_length": 0.26,
            "vasti.optimal_fiber_length.factor": 1.1,
            "gluteus*.max_isometric_force.factor": 0.5,
            "*.tendon_strain_at_one_norm_force.factor": 1.2,
        }
    )
    assert muscle(model, "soleus").tendon_slack_length == 0.26
    assert muscle(model, "vasti").optimal_fiber_length == pytest.approx(1.1 * 0.087, rel=1e-15)
    for one, other in zip(model.muscles, before.muscles, strict=True):
        ratio = one.max_isometric_force / other.max_isometric_force
        assert ratio == (0.5 if one.name.startswith("gluteus") else 1.0)
        assert one.tendon_strain == pytest.approx(1.2 * other.tendon_strain)


@pytest.mark.parametrize("name", ["mass.5", "mass.knee", "mass.kn*"])
def test_masses_of_links(name):
    before = leg.build()
    for given, ratio in (({name: 6.495}, 2.0), ({f"{name}.factor": 2.0}, 2.0)):
        model = model_of(given)
        for what in ("linkMasses", "linkInertiasCOM"):
            new, old = (
                np.array([np.array(each) for each in _items(x.mbs.GetObjectParameter(0, what))])
                for x in (model, before)
            )
            np.testing.assert_allclose(new[5], ratio * old[5], rtol=1e-14)
            np.testing.assert_array_equal(np.delete(new, 5, 0), np.delete(old, 5, 0))
    result = em.static_optimization(model, leg.motion())  # which knows the new masses
    assert result.torques_demanded.shape[1] == 6


def _items(values):
    return [values[i] for i in range(len(values))]


def test_masses_of_bodies():
    before, model = (
        pedalling.build(),
        model_of({"mass.sh*": 7.2, "mass.crank.factor": 3.0}, pedalling),
    )
    ratios = {"thigh": 1.0, "shank": 2.0, "crank": 3.0}
    for number in range(1, 4):
        old, new = (x.mbs.GetObject(number) for x in (before, model))
        ratio = ratios[old["name"]]
        assert new["mass"] == pytest.approx(ratio * old["mass"], rel=1e-14)
        np.testing.assert_allclose(new["inertia"], ratio * old["inertia"], rtol=1e-14)
    heavier, as_it_is = (em.static_optimization(x, pedalling.motion()) for x in (model, before))
    assert np.abs(heavier.torques_demanded - as_it_is.torques_demanded).max() > 1.0


def test_noise_is_of_the_run_alone():
    given = study(3)
    runs = [given.run(k) for k in (0, 1, 1)]
    motions = [
        studies.parameters.changed_motion(short_motion(), {"motion.noise": 0.01}, run.random)
        for run in runs
    ]
    t = np.linspace(0.0, 0.1, 11)
    q, v, a = zip(*(motion(t) for motion in motions), strict=True)
    np.testing.assert_array_equal(q[1], q[2])
    assert np.abs(q[0] - q[1]).max() > 1e-3
    assert 1e-3 < np.abs(q[0] - short_motion()(t)[0]).max() < 0.05
    h = 1e-6
    slope = (motions[0](0.05 + h)[0] - motions[0](0.05 - h)[0]) / (2.0 * h)
    np.testing.assert_allclose(motions[0](0.05)[1], slope, rtol=1e-6)


def test_settings_and_arguments_reach_the_run():
    source = studies.Builder(subjects.build_unless, short_motion)
    samples = studies.Samples(("settings.kp", "source.weak"), [[111.0, 0.0], [222.0, 1.0]])
    given = studies.Study(
        source, samples, studies.Method("csf", {"step": 0.005}), trajectories=True
    )
    (row, result), (failed, nothing) = (compute(given.run(k)) for k in (0, 1))
    assert (result.settings["kp"], result.settings["step"], row.status) == (
        111.0,
        0.005,
        "complete",
    )
    assert (failed.status, failed.message, nothing) == ("failed", "ValueError: too weak: 1", None)


@pytest.mark.parametrize(
    "name", ["soleus", "soleus.length", "mass", "motion.speed", "settings.", "kp", ""]
)
def test_what_is_no_parameter(name):
    with pytest.raises(em.StudyError, match="expected MUSCLE"):
        studies.Samples((name,), [[1.0]])


@pytest.mark.parametrize(
    ("parameters", "text"),
    [
        ({"calf.tendon_slack_length": 0.2}, "there is no such muscle, only gluteus_maximus"),
        ({"soleus.max_isometric_force": -1.0}, "outside"),
        ({"mass.elbow": 1.0}, "there is no such link or body that has a mass"),
        ({"mass.3": 1.0}, "there is no such link or body that has a mass"),  # of no mass
        ({"mass.5": 0.0}, "is no positive number"),
    ],
)
def test_parameters_that_the_model_does_not_have(parameters, text):
    with pytest.raises(em.ExudynMusclesError, match=text):
        model_of(parameters)


# Samples


def test_samples_that_are_wrong():
    for values, text in (
        ([[1.0, 2.0]], "do not fit 1 parameters"),
        ([[np.nan]], "'settings.kp' of run 0 is nan"),
    ):
        with pytest.raises(em.StudyError, match=text):
            studies.Samples(("settings.kp",), values)
    with pytest.raises(em.StudyError, match="twice"):
        studies.Samples(("settings.kp", "settings.kp"), [[1.0, 2.0]])
    with pytest.raises(em.StudyError, match="is no range"):
        studies.latin_hypercube({"settings.kp": (2.0, 1.0)}, 4)
    with pytest.raises(em.StudyError, match="a power of 2"):
        studies.sobol_design(RANGES, 12)


@pytest.mark.parametrize(
    "draw", ["latin_hypercube", "sobol_sequence", "morris_design", "sobol_design"]
)
def test_samples_stay_in_their_ranges_and_follow_their_seed(draw):
    sampler = getattr(studies, draw)
    one, again, other = sampler(RANGES, 8, 1), sampler(RANGES, 8, 1), sampler(RANGES, 8, 2)
    np.testing.assert_array_equal(one.values, again.values)
    assert not np.array_equal(one.values, other.values)
    low, high = np.array(list(RANGES.values())).T
    assert ((one.values >= low) & (one.values <= high)).all()
    assert len(one) == {"morris_design": 8 * 4, "sobol_design": 8 * 5}.get(draw, 8)


def test_samples_of_a_table():
    import pandas

    frame = pandas.DataFrame({"settings.kp": [1, 2], "mass.1.factor": [0.5, 1.5]})
    samples = studies.Samples.from_dataframe(frame)
    assert samples.names == ("settings.kp", "mass.1.factor")
    np.testing.assert_array_equal(samples.values, [[1.0, 0.5], [2.0, 1.5]])
    with pytest.raises(em.StudyError, match="could not convert"):
        studies.Samples.from_dataframe(frame.assign(**{"settings.kv": "much"}))


# Outcomes


@pytest.fixture(scope="module")
def result():
    return em.static_optimization(pendulum.build(), pendulum.motion())


def value(what, result):
    outcome = studies.study.Outcome("x", what)
    return studies.outcomes.values((outcome,), pendulum.build(), result)[0]


def test_outcomes_are_what_they_say(result):
    F = result.tendon_forces
    assert value("max(tendon_forces/left)", result) == F[:, 0].max()
    assert value("min( tendon_forces )", result) == F.min()
    assert value("rms(activations/right)", result) == np.sqrt(
        np.mean(result.activations[:, 1] ** 2)
    )
    assert value("mean(excitations)", result) == result.excitation_values.mean()
    assert value("range(coordinates/theta)", result) == np.ptp(result.coordinates)
    assert value("absmax(torques_demanded)", result) == np.abs(result.torques_demanded).max()
    assert value("last(tendon_forces/left)", result) == F[-1, 0]
    at = np.interp(0.333, result.time, F[:, 0])
    assert value("at(tendon_forces/left, 0.333)", result) == pytest.approx(at, rel=1e-15)
    assert value("max_unmet_torque", result) == result.max_unmet_torque
    assert value(lambda model, found: found.time[-1], result) == 1.0
    assert value("tests.studies.subjects:slowest_force", result) > 0.0
    share = em.analysis.muscle_analysis(pendulum.build(), result)["passive_share/left"]
    assert value("max(muscle_analysis:passive_share/left)", result) == share.max()
    loads = em.analysis.joint_loads(pendulum.build(), result)["force"]
    sizes = np.linalg.norm(loads, axis=1)
    assert value("max(joint_forces:size/theta)", result) == pytest.approx(sizes.max(), rel=1e-14)


@pytest.mark.parametrize(
    "what",
    ["tendon_forces", "largest(tendon_forces)", "max(tendon_forces, 0.3)", "at(tendon_forces)",
     "max()", "max(nothing:x)", "max(a)(b)", "module:"],
)  # fmt: skip
def test_what_is_no_outcome(what):
    with pytest.raises(em.StudyError, match="outcome"):
        study(outcomes={"x": what})


@pytest.mark.parametrize(
    ("what", "text"),
    [
        ("max(force)", "there is no quantity 'force', only time, window_time"),
        ("max(tendon_forces/middle)", "tendon_forces: there is no 'middle', only left, right"),
        ("max(reserves)", "there is nothing in this result"),
        ("at(tendon_forces, 1.5)", "the result spans 0 to 1 s"),
        ("tests.studies.subjects:no_number", "gives no number but 'much'"),
        ("tests.studies.subjects:missing", "cannot be imported"),
        ("max(power:strength)", "no column or quantity 'strength'"),
    ],
)
def test_outcomes_that_a_result_does_not_have(what, text, result):
    with pytest.raises(em.ExudynMusclesError, match=text):
        value(what, result)


# Methods, and the whole


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"method": "rra"}, "method 'rra' is none of static, cmc, csf"),
        ({"outcomes": {}}, "without outcomes"),
        ({"source": ()}, "without runs"),
        ({"samples": studies.Samples(("settings.speed",), [[1.0]])}, "there is no 'speed', only"),
    ],
)
def test_what_is_no_study(changes, text):
    given = {"source": SOURCES["by name"](), **changes}
    with pytest.raises(em.StudyError, match=text):
        studies.Study(**given)


@pytest.mark.parametrize("method", ["static", "cmc", "csf", "css", "consistent", None])
def test_all_methods(method):
    given = studies.Study(SOURCES["by name"](), method=studies.Method(method), trajectories=True)
    row, result = compute(given.run(0))
    assert (result.method, row.status) == (method or "consistent", "complete")


def test_evaluate_raises_what_a_run_would_keep():
    given = study()
    assert studies.evaluate(given, {})["peak"] > 0.0
    with pytest.raises(em.ParameterError, match="outside"):
        studies.evaluate(given, {"*.max_isometric_force": 0.0})
    with pytest.raises(em.StudyError, match="foo"):
        studies.evaluate(given, {"foo": 1.0})


def test_several_sources_and_warnings():
    source = SOURCES["by name"]()
    weak = studies.Samples(("*.max_isometric_force.factor",), [[1.0], [0.05]])
    given = studies.Study([source, source], weak, "static")
    assert given.size == 4 and given.run(3).parameters == {"*.max_isometric_force.factor": 0.05}
    row, nothing = compute(given.run(3))
    assert row.warnings.startswith("UnmetTorqueWarning: ") and nothing is None
    assert row.outcomes[0] > 1.0
