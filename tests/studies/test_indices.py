"""Indices by SALib of a study's table: of known functions, and of the leg beside an estimate by
another way."""

from itertools import combinations_with_replacement
from math import pi

import numpy as np
import pandas
import pytest

import exudyn_muscles as em
from exudyn_muscles import studies

from . import subjects

NAMES = ("settings.kp", "settings.kv", "motion.noise")  # of any parameters


def table(samples, function):
    """As of a study whose outcome is a function of the parameters."""
    y = function(*samples.values.T)
    return pandas.DataFrame({"status": "complete", "message": "", "y": y})


def test_sobol_indices_of_a_known_function():
    """T. Ishigami, T. Homma, Proc. ISUMA 1990, 398-403, with a = 7, b = 0.1."""
    samples = studies.sobol_design(dict.fromkeys(NAMES, (-pi, pi)), 4096)
    function = lambda x, y, z: np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)  # noqa: E731
    found = studies.indices(samples, table(samples, function), "y")
    np.testing.assert_allclose(found["S1"], [0.3139, 0.4424, 0.0], atol=0.02)
    np.testing.assert_allclose(found["ST"], [0.5576, 0.4424, 0.2437], atol=0.02)
    assert tuple(found.index) == NAMES and (found["S1_conf"] < 0.1).all()


def test_morris_indices_are_over_the_whole_range():
    samples = studies.morris_design(
        {"settings.kp": (0.0, 10.0), "settings.kv": (1.0, 3.0), "motion.noise": (0.0, 1.0)}, 16
    )
    found = studies.indices(samples, table(samples, lambda x, y, z: 3.0 * x - 4.0 * y), "y")
    np.testing.assert_allclose(found["mu"], [30.0, -8.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(found["mu_star"], [30.0, 8.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(found["sigma"], 0.0, atol=1e-9)


def test_no_indices():
    samples = studies.sobol_design(dict.fromkeys(NAMES, (0.0, 1.0)), 8)
    whole = table(samples, lambda x, y, z: x)
    with pytest.raises(em.StudyError, match="the table has no outcome 'z'"):
        studies.indices(samples, whole, "z")
    with pytest.raises(em.StudyError, match="39 runs are not those of 40 samples"):
        studies.indices(samples, whole[:-1], "y")
    failed = whole.assign(y=whole["y"].where(whole.index != 7), status="failed", message="weak")
    with pytest.raises(
        em.StudyError, match="1 runs have none, the first of them run 7: failed weak"
    ):
        studies.indices(samples, failed, "y")
    with pytest.raises(em.StudyError, match="it is 1 in all runs"):
        studies.indices(samples, whole.assign(y=1.0), "y")
    hypercube = studies.latin_hypercube(dict.fromkeys(NAMES, (0.0, 1.0)), 40)
    with pytest.raises(em.StudyError, match="need samples of sobol_design or morris_design"):
        studies.indices(hypercube, whole, "y")


def test_figures():
    samples = studies.morris_design(dict.fromkeys(NAMES, (0.0, 1.0)), 8)
    found = studies.indices(samples, table(samples, lambda x, y, z: x * y + 3.0 * z), "y")
    axes = em.plot.indices(found)
    assert [label.get_text() for label in axes.get_yticklabels()][-1] == "motion.noise"
    assert len(axes.patches) == 6 and axes.get_title() == "y"
    with pytest.raises(em.ParameterError, match="there are no indices among status"):
        em.plot.indices(table(samples, lambda x, y, z: x))


RANGES = {
    "vasti.max_isometric_force.factor": (0.7, 1.3),
    "rectus_femoris.max_isometric_force.factor": (0.7, 1.3),
    "mass.7.factor": (0.8, 1.2),
}
OUTCOMES = {"iliopsoas": "mean(tendon_forces/iliopsoas)", "knee": "mean(joint_forces:size/knee)"}


def expanded(samples, y):
    """First and total indices by polynomials of third degree, orthonormal over the ranges and
    fitted to the runs of other samples: their coefficients are parts of the variance (B. Sudret,
    Reliability Engineering and System Safety 93 (2008), 964-979)."""
    low, high = np.array(list(samples.ranges.values())).T
    x = 2.0 * (samples.values - low) / (high - low) - 1.0
    p = x.shape[1]
    powers = [()] + [c for d in (1, 2, 3) for c in combinations_with_replacement(range(p), d)]
    degrees = np.array([[c.count(j) for j in range(p)] for c in powers])
    basis = np.ones((len(x), len(powers)))
    for k, row in enumerate(degrees):
        for j, degree in enumerate(row):
            legendre = np.polynomial.legendre.Legendre.basis(degree)(x[:, j])
            basis[:, k] *= np.sqrt(2 * degree + 1) * legendre
    c = np.linalg.lstsq(basis, y, rcond=None)[0]
    parts = np.where(degrees.any(axis=1), c**2, 0.0) / np.sum(c[1:] ** 2)
    alone = np.count_nonzero(degrees, axis=1) == 1
    first = [parts[alone & (degrees[:, j] > 0)].sum() for j in range(p)]
    return np.array(first), np.array([parts[degrees[:, j] > 0].sum() for j in range(p)])


def test_indices_of_a_muscle_force_and_a_joint_load_of_the_leg(tmp_path):
    source = studies.Builder("models.leg:build", subjects.first_steps)
    samples = studies.sobol_design(RANGES, 32, seed=1)
    table = studies.run(studies.Study(source, samples, "static", OUTCOMES), tmp_path / "sobol")
    others = studies.latin_hypercube(RANGES, 60, seed=2)
    beside = studies.run(studies.Study(source, others, "static", OUTCOMES), tmp_path / "others")
    for outcome in OUTCOMES:
        found = studies.indices(samples, table, outcome)
        first, total = expanded(others, beside[outcome].to_numpy())
        print(outcome, found.round(3).to_dict("list"), first.round(3), total.round(3))
        for name, right in (("S1", first), ("ST", total)):
            assert (np.abs(found[name] - right) < found[f"{name}_conf"]).all()
            np.testing.assert_allclose(found[name], right, atol=0.1)
        assert np.count_nonzero(total > 0.2) >= 2
