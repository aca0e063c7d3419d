"""Slack lengths and strengths: found again from made torques, and chosen by what fibres are to
do."""

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles import studies
from exudyn_muscles.studies.identification import _Torques
from models import leg, planar_arm

SOUGHT = ("soleus", "gastrocnemius", "tibialis_anterior")


@pytest.fixture(scope="module")
def model():
    return leg.build()


def poses(count=60, seed=0):
    """Of a dynamometer: knee and ankle go through their ranges, the others stay."""
    rng = np.random.default_rng(seed)
    q = np.zeros((count, 6))
    q[:, 3] = np.radians(rng.uniform(-90.0, 0.0, count))
    q[:, 4] = np.radians(rng.uniform(-30.0, 25.0, count))
    return q


def torques(model, q, a=None, v=None):
    """Of the muscles, computed one by one."""
    v = np.zeros_like(q) if v is None else v
    a = np.tile(model.muscles.minimum_activation, (len(q), 1)) if a is None else a
    made = np.full((len(q), 6), np.nan)
    for k in range(len(q)):
        at = model.geometry(q[k], v[k])
        F = em.equilibrium(model.muscles, a[k], at.length, at.lengthening_speed).force
        made[k] = at.moment_arms.T @ F
    return made


def changed(model, slack, strength=1.0):
    """The model with other muscles of those that are sought."""
    factors = dict(zip(SOUGHT, slack, strict=True))
    return model.replace(
        muscles=[
            em.Muscle(
                **{
                    **{name: getattr(m, name) for name in m.__dataclass_fields__ if name != "_"},
                    "tendon_slack_length": factors.get(m.name, 1.0) * m.tendon_slack_length,
                    "max_isometric_force": (strength if m.name in factors else 1.0)
                    * m.max_isometric_force,
                }
            )
            for m in model.muscles
        ]
    )


@pytest.mark.parametrize("rigid", [False, True])
def test_slack_lengths_from_passive_torques(model, rigid):
    true = changed(model, (0.985, 1.01, 0.98))
    if rigid:
        true, model = (
            each.replace(muscles=em.operators.ignore_tendon_compliance(each.muscles))
            for each in (true, model)
        )
    q = poses()
    measured = torques(true, q)
    measured[:, :3] = np.nan  # of the hip nothing is known
    found = studies.identify(model, studies.TorqueRecord(q, measured), slack_lengths=SOUGHT)
    right = [m.tendon_slack_length for m in true.muscles if m.name in SOUGHT]
    order = [m.name for m in true.muscles if m.name in SOUGHT]
    values = dict(zip(found.parameters, found.values, strict=True))
    for name, l_ts in zip(order, right, strict=True):
        assert values[f"{name}.tendon_slack_length"] == pytest.approx(l_ts, rel=1e-7)
    assert found.rms < 1e-6 and (found.standard_errors < 1e-6).all()


@pytest.mark.parametrize("moves", [False, True])
def test_strengths_and_slack_lengths_from_emg_and_torques(model, moves):
    true = changed(model, (0.98, 1.015, 0.99), 1.3)
    q, rng = poses(80), np.random.default_rng(1)
    a = np.maximum(rng.uniform(0.0, 0.6, (80, 19)), model.muscles.minimum_activation)
    v = rng.uniform(-0.5, 0.5, q.shape) if moves else None
    record = studies.TorqueRecord(q, torques(true, q, a, v), a, v)
    found = studies.identify(model, record, slack_lengths=SOUGHT, strengths=SOUGHT)
    fresh = model.replace(muscles=found.muscles)
    for one, other in zip(fresh.muscles, true.muscles, strict=True):
        assert one.tendon_slack_length == pytest.approx(other.tendon_slack_length, rel=1e-4)
        assert one.max_isometric_force == pytest.approx(other.max_isometric_force, rel=1e-4)


def test_noise_is_within_the_standard_errors(model):
    true = changed(model, (0.985, 1.01, 0.98))
    q, rng = poses(200), np.random.default_rng(2)
    measured = torques(true, q) + 0.2 * rng.standard_normal((200, 6))
    found = studies.identify(model, studies.TorqueRecord(q, measured), slack_lengths=SOUGHT)
    right = np.array([dict(zip(SOUGHT, (0.985, 1.01, 0.98), strict=True))[x] for x in SOUGHT])
    right *= [m.tendon_slack_length for x in SOUGHT for m in model.muscles if m.name == x]
    assert (np.abs(found.values - right) < 4.0 * found.standard_errors).all()
    assert found.rms == pytest.approx(0.2, rel=0.1)


@pytest.mark.parametrize("active", [False, True])
def test_derivatives_are_those_of_the_torques(model, active):
    q = poses(12)
    a = np.full((12, 19), 0.4) if active else None
    record = studies.TorqueRecord(q, np.zeros((12, 6)), a)
    numbers = [model.muscles.names.index(name) for name in SOUGHT]
    equations = _Torques(model, record, numbers, numbers)
    x, h = np.array([0.98, 1.01, 0.97, 1.2, 0.9, 1.1]), 1e-6
    exact = equations.jacobian(x)
    for k, step in enumerate(h * np.eye(6)):
        slope = (equations.residuals(x + step) - equations.residuals(x - step)) / (2.0 * h)
        np.testing.assert_allclose(exact[:, k], slope, atol=1e-5 * np.abs(exact[:, k]).max() + 1e-9)


def test_what_the_record_does_not_determine_has_infinite_errors(model):
    """Torques of the hip, which the soleus does not cross."""
    q = poses(20)
    measured = torques(model, q)
    measured[:, 3:] = np.nan
    record = studies.TorqueRecord(q, measured)
    found = studies.identify(model, record, slack_lengths=["soleus", "rectus_femoris"])
    assert np.isinf(found.standard_errors[0]) and np.isfinite(found.standard_errors[1])


def test_records_that_do_not_fit(model):
    q = poses(5)
    with pytest.raises(em.ParameterError, match="there is no muscle 'calf', only gluteus"):
        studies.identify(model, studies.TorqueRecord(q, q), slack_lengths=["calf"])
    wrong = [
        (studies.TorqueRecord(q, q[:, :5]), r"torques \(5, 6\) were expected, got \(5, 5\)"),
        (studies.TorqueRecord(q, q, np.ones((5, 3))), r"activations \(5, 19\) were expected"),
        (studies.TorqueRecord(q, q, np.full((5, 19), 2.0)), r"activations from 2 to 2 are outside"),
        (studies.TorqueRecord(q * np.nan, q), "coordinates have values that are no numbers"),
    ]
    for record, says in wrong:
        with pytest.raises(em.ParameterError, match=says):
            studies.identify(model, record, slack_lengths=["soleus"])
    with pytest.raises(em.ParameterError, match=r"such as \['soleus'\], were expected"):
        studies.identify(model, studies.TorqueRecord(q, q), slack_lengths="soleus")
    nothing = studies.TorqueRecord(q, np.full_like(q, np.nan))
    with pytest.raises(em.ParameterError, match="0 torques for 1 unknowns"):
        studies.identify(model, nothing, slack_lengths=["soleus"])


# Choosing


@pytest.mark.parametrize("rigid", [False, True])
@pytest.mark.parametrize("activation", [0.01, 1.0])
def test_chosen_tendons_of_the_leg(model, rigid, activation):
    """Every fibre of the leg's step works around the middle of the range."""
    motion = leg.motion()
    muscles = em.operators.ignore_tendon_compliance(model.muscles, ignore=rigid)
    model = model.replace(muscles=muscles)
    chosen = studies.choose_tendon_slack_lengths(model, motion, (0.3, 1.5), activation=activation)
    lengths = model.lengths_along(motion(np.linspace(0.0, 1.0, 101))[0])
    units = em.MuscleSet(chosen)
    a = np.maximum(activation, units.minimum_activation)
    fibers = np.array([em.equilibrium(units, a, l).fiber_length for l in lengths])
    fibers /= units.optimal_fiber_length
    middle = 0.5 * (fibers.min(axis=0) + fibers.max(axis=0))
    np.testing.assert_allclose(middle, 0.9, atol=1e-6)
    assert fibers.min() > 0.3 and fibers.max() < 1.5
    assert (
        em.static_optimization(model.replace(muscles=chosen), motion).status is em.Status.COMPLETE
    )


def test_chosen_tendons_of_some_muscles(model):
    chosen = studies.choose_tendon_slack_lengths(model, leg.motion(), (0.5, 1.3), ["soleus"])
    other = [one.name for one, before in zip(chosen, model.muscles, strict=True) if one != before]
    assert other == ["soleus"]


def test_fibers_that_cannot_stay_within_the_range(model):
    with pytest.raises(em.ParameterError) as failure:
        studies.choose_tendon_slack_lengths(model, leg.motion(), (0.95, 1.05))
    text = str(failure.value)
    assert "'gluteus_maximus' from" in text and "'peroneus_longus' from 0.942 to 1.06" in text
    assert text.count("of at least some") > 10


def test_ranges_and_motions_that_are_wrong(model):
    for wrong in ((1,), "a", (1.2, 0.5)):
        with pytest.raises(em.ParameterError, match="are not two increasing numbers"):
            studies.choose_tendon_slack_lengths(model, leg.motion(), wrong)
    with pytest.raises(em.MotionError):
        studies.choose_tendon_slack_lengths(model, planar_arm.motion(), (0.5, 1.3))


def test_a_path_that_is_too_short():
    model, motion = planar_arm.build(), planar_arm.motion()
    first = next(iter(model.muscles))
    long = em.Muscle(
        first.name, max_isometric_force=100.0, optimal_fiber_length=2.0,
        tendon_slack_length=0.01, path=first.path,
    )  # fmt: skip
    model = model.replace(muscles=[long])
    with pytest.raises(em.ParameterError, match="its path is too short for its fiber"):
        studies.choose_tendon_slack_lengths(model, motion, (0.5, 1.2))
