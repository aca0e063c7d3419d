"""Random trees with random muscles, reserves and motions in all methods, and the replay of their
excitations: documented errors only, no NaN, the status, the same bits twice, torques and power that
balance, a stored result that is the same. Some motions are far too violent for the muscles.
"""

import dataclasses
import tempfile
from pathlib import Path

import exudyn as exu
import numpy as np

import exudyn_muscles as em

from ..path.trees import add_tree, random_links
from ..zoo import LAWS

SPAN = 0.08  # s
UNIT = {"max_isometric_force": 1.0, "optimal_fiber_length": 0.1, "tendon_slack_length": 0.1}
# A run may end in these, with what was reached in `trajectory`.
DOCUMENTED = em.SimulationError, em.WindowError, em.WrappingError
RESERVED = 0.8  # part of the coordinates that get a reserve


def point(rng, n):
    return em.PathPoint(rng.uniform(-0.3, 0.3, 3), int(rng.integers(-1, n)))


def muscles(rng, n):
    """Paths that cross a joint, some over a surface; sizes come later."""
    found = []
    for k in range(int(rng.integers(1, 7))):
        path = [point(rng, n) for _ in range(rng.integers(2, 5))]
        path[-1] = em.PathPoint(path[-1].position, int(rng.integers(0, n)))
        if path[0].link == path[-1].link:
            path[0] = em.PathPoint(path[0].position, path[-1].link - 1)
        wraps = []
        if rng.random() < 0.3:
            radius, place = rng.uniform(0.02, 0.1), rng.uniform(-0.1, 0.1, 3)
            kind = (em.WrapCylinder, em.WrapSphere)[rng.integers(2)]
            wraps = [kind(radius, position=place, link=int(rng.integers(-1, n)))]
        found.append(em.Muscle(f"m{k}", **UNIT, path=path, wraps=wraps))
    return found


def sized(rng, muscle, length):
    """With fibres near their optimal length."""
    ratio = 10.0 ** rng.uniform(-0.7, 0.7)
    optimal = length / (1.02 * ratio + rng.uniform(0.8, 1.1))
    return dataclasses.replace(
        muscle,
        max_isometric_force=10.0 ** rng.uniform(1.5, 3.5),
        optimal_fiber_length=optimal,
        tendon_slack_length=ratio * optimal,
        pennation_angle_at_optimal=rng.choice([0.0, 0.2]),
        activation_dynamics=rng.choice(list(em.ActivationDynamics)),
        law=list(LAWS.values())[rng.integers(len(LAWS))],
        ignore_tendon_compliance=bool(rng.random() < 0.1),
    )


def draw(rng):
    """A model and its motion."""
    n = int(rng.integers(1, 5))
    mbs = exu.SystemContainer().AddSystem()
    tree = add_tree(mbs, rng, random_links(rng, n))
    mbs.Assemble()
    start = rng.uniform(-1.0, 1.0, n)
    given = muscles(rng, n)
    rough = em.MusculoskeletalModel(mbs, tree, given)
    rough.skeleton.set_initial_state(start, np.zeros(n))
    lengths = rough.geometry(start, np.zeros(n)).length
    given = [sized(rng, *pair) for pair in zip(given, np.maximum(lengths, 0.02), strict=True)]
    reserves = [
        em.Reserve(f"q{j}", 10.0 ** rng.uniform(-1.0, 3.0), -limit, limit)
        for j in range(n)
        for limit in [rng.choice([np.inf, 1.0])]
        if rng.random() < RESERVED
    ]
    model = em.MusculoskeletalModel(mbs, tree, given, reserves=reserves)
    amplitude = rng.choice([0.02, 0.02, 0.2, 2.0])
    way = start + np.vstack([np.zeros(n), rng.normal(0.0, amplitude, (2, n))])
    return model, em.Motion.from_waypoints([0.0, 0.5 * SPAN, SPAN], way)


def methods(rng, tolerance):
    """Name -> function of a model and a motion."""
    kp = 10.0 ** rng.uniform(1.0, 3.0)
    given = {"integrator": rng.choice(list(em.Integrator)), "window_tolerance": tolerance}
    cmc = em.CMCSettings(kp=kp, prediction=rng.choice(list(em.Prediction)), **given)
    runs = {
        "static": lambda *x: em.static_optimization(*x, settings=em.StaticSettings(**given)),
        "cmc": lambda *x: em.computed_muscle_control(*x, settings=cmc),
    }
    for scheme in em.Scheme:
        csf = em.CosimulationSettings(kp=kp, scheme=scheme, **given)
        runs[scheme.value] = lambda *x, csf=csf: em.cosimulate(*x, settings=csf)
    return runs


def outcome(run):
    """The result, or what a documented error carries, and the error's name or "complete"."""
    try:
        return run(), "complete"
    except em.ParameterError:  # lengths that are of no use, before anything is simulated
        return None, "refused"
    except DOCUMENTED as error:
        return getattr(error, "trajectory", None), type(error).__name__


def arrays(result):
    """Everything but what the run cost."""
    return {k: v.tobytes() for k, v in vars(result).items() if isinstance(v, np.ndarray)}


def balanced(model, result, tolerance):
    """Power: tau q' + F l' = 0. At the ends of windows r^T F and the reserves are the torque, to
    the `tolerance` of forces over F0; that of the simplified co-simulation belongs to a predicted
    state."""
    F0 = model.muscles.max_isometric_force
    for k, t in enumerate(result.time):
        q, v, F = result.coordinates[k], result.speeds[k], result.tendon_forces[k]
        geometry = model.geometry(q, v)
        r, S = geometry.moment_arms, geometry.columns
        torque, terms = r.T @ F, np.abs(r).T @ np.abs(F)
        power = torque @ v + F @ geometry.lengthening_speed
        assert abs(power) < 1e-12 * (1.0 + terms @ np.abs(v)), f"power {power} W at t = {t} s"
        ends = np.flatnonzero(result.window_time == t)
        if not ends.size or result.method == "css":
            continue
        if S.size:
            torque = torque + S @ result.reserves[ends[0]]
            terms = terms + np.abs(S) @ np.abs(result.reserves[ends[0]])
        off = np.abs(torque - result.torques_delivered[k])
        allowed = 10.0 * tolerance * (np.abs(r).T @ (F0 + np.abs(F))) + 1e-8 * (1.0 + terms)
        assert (off < allowed).all(), f"{result.method}: r^T F is off by {off} at t = {t} s"


def check_result(model, result, status, tolerance):
    if status == "complete" and result.has_lost_its_motion:
        expected = em.Status.LOST
    else:
        expected = em.Status.COMPLETE if status == "complete" else em.Status.INCOMPLETE
    assert result.status is expected, f"{result.status} of a run that was {status}"
    for name in ("coordinates", "speeds", "accelerations", "activations", "tendon_forces",
                 "torques_delivered", "excitation_values", "torques_unmet"):  # fmt: skip
        assert np.isfinite(getattr(result, name)).all(), f"{name} is not finite"
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "result.npz"
        result.save(file)
        again = em.Trajectory.load(file)
    assert arrays(again) == arrays(result), "another result after loading"
    balanced(model, result, tolerance)


def check(rng):
    try:
        model, motion = draw(rng)
    except (em.WrappingError, em.ParameterError):
        return "no model"
    tolerance = 10.0 ** rng.uniform(-5.0, -2.0)
    runs = methods(rng, tolerance)
    name = rng.choice(list(runs))
    result, status = outcome(lambda: runs[name](model, motion))
    again, status_again = outcome(lambda: runs[name](model, motion))
    assert status == status_again, f"{name}: {status}, then {status_again}"
    if result is None:
        return f"{name} {status}"
    assert arrays(result) == arrays(again), f"{name}: other bits the second time"
    check_result(model, result, status, tolerance)
    if status == "complete" and name != "static":
        replay, how = outcome(lambda: em.forward_dynamics(model, result.excitations))
        if replay is not None:
            check_result(model, replay, how, tolerance)
        if how == "complete" and name == "cmc":
            off = np.abs(replay.coordinates - result.coordinates).max()
            assert off < 1e-6, f"CMC's replay is {off} off"
    return f"{name} {status}"
