"""What the paper's Table 2 says and what it leaves open: the numbers of `docs/theory/table2.md`.

    python -m tests.benchmarks.paper_table

Asserts nothing. The error of CSF follows from motion, step and gains alone, whatever skeleton and
muscles are: the recruited torques cancel M, H and Q, and what is left is the rule on the error's
own equation. CSS cancels them at a predicted state, so that a little of the weight is left, which
for a pendulum depends on its length. The error of CMC follows from how the torque runs within a
window, and so from the muscles.
"""

import dataclasses
import warnings

import numpy as np
from scipy.optimize import brentq, fsolve

import exudyn_muscles as em
from models import pendulum

PRINTED = {"cmc": 0.0025, "csf": 0.0186, "css": 0.1146}  # RMS errors [deg]
WINDOW, FINE = 0.01, 0.001  # s
KP = 534.0  # 1/s^2
PULL = 9.81 / pendulum.LENGTH  # of the weight [1/s^2]
DRAWS, SEED = 200, 1


def desired(step):
    """q_d, q_d', q_d'' at all steps, one row each."""
    motion = pendulum.motion()
    t = np.arange(round((motion.end - motion.start) / step) + 1) * step
    return np.array([column[:, 0] for column in motion(np.minimum(t, motion.end))]).T


def rms(errors):
    return np.degrees(np.sqrt(np.mean(np.square(errors))))


def cosimulated(kp, kv, predicts):
    """RMS error [deg] of the trapezoidal rule on q'' = q_d'' + kv e' + kp e, with the errors of the
    state at the step's end (CSF), or of the one predicted with a constant acceleration (CSS)."""
    h, rows = WINDOW, desired(WINDOW)
    q, v, a = rows[0]
    errors = [0.0]
    for q_d, v_d, a_d in rows[1:]:
        q_0, v_0 = q + h * v + h * h / 4 * a, v + h / 2 * a  # without the end's acceleration
        if predicts:
            ahead, e_t = q + h * v + h * h / 2 * a, v_d - (v + h * a)
            asked = a_d + kv * e_t + kp * (q_d - ahead)
            for _ in range(8):
                a = asked + PULL * (np.sin(ahead) - np.sin(q_0 + h * h / 4 * a))
        else:
            a = (a_d + kv * (v_d - v_0) + kp * (q_d - q_0)) / (1 + kv * h / 2 + kp * h * h / 4)
        q, v = q_0 + h * h / 4 * a, v_0 + h / 2 * a
        errors.append(q_d - q)
    return rms(errors)


def computed(mean, kp=KP):
    """RMS error [deg] of CMC where every torque runs through its window as s^p, with this mean."""
    per_window = round(WINDOW / FINE)
    rows = desired(FINE)
    kv, power = 2.0 * np.sqrt(kp), 1.0 / mean - 1.0
    (q, v, a), torque = rows[0], rows[0, 2] + PULL * np.sin(rows[0, 0])  # over the inertia
    errors = [0.0]
    for start in range(0, len(rows) - 1, per_window):
        (q_d, v_d, _), (q_e, _, a_e) = rows[start], rows[start + per_window]
        before = torque
        asked = a_e + kv * (v_d - v) + kp * (q_d - q)
        torque = asked + PULL * np.sin(q_e)
        for k in range(1, per_window + 1):
            now = before + (torque - before) * (k / per_window) ** power
            q_0, v_0 = q + FINE * v + FINE**2 / 4 * a, v + FINE / 2 * a
            for _ in range(4):
                a = now - PULL * np.sin(q)
                q, v = q_0 + FINE**2 / 4 * a, v_0 + FINE / 2 * a
            errors.append(rows[start + k, 0] - q)
    return rms(errors)


def mean_within_windows(result):
    """How the delivered torque of a run of CMC runs within its windows: the mean of its change over
    a window over the whole change, of all windows by least squares."""
    per_window = round(WINDOW / FINE)
    torque = result.torques_delivered[:, 0]
    pieces = torque[:-1].reshape(-1, per_window)
    first, last = pieces[:, 0], np.append(pieces[1:, 0], torque[-1])
    inner = 0.5 * (first + last) + pieces[:, 1:].sum(axis=1)
    change, mean = last - first, inner / per_window - first
    return change @ mean / (change @ change)


def of_run(muscles=None):
    """CMC of the pendulum, with other muscles if they are given."""
    model = pendulum.build()
    if muscles is not None:
        model = model.replace(muscles=muscles)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", em.ExudynMusclesWarning)
        settings = em.CMCSettings(kp=KP, window=WINDOW, step=FINE)
        return em.computed_muscle_control(model, pendulum.motion(), settings=settings)


def drawn(random):
    """The pendulum's muscles with other lengths and constants, the same ones on both sides."""
    muscles = list(pendulum.build().muscles)
    changes = {
        "optimal_fiber_length": random.uniform(0.08, 0.2),
        "max_isometric_force": random.uniform(1500.0, 6000.0),
        "pennation_angle_at_optimal": random.uniform(0.0, 0.4),
        "max_contraction_velocity": random.uniform(7.0, 13.0),
        "activation_time_constant": random.uniform(0.008, 0.02),
        "deactivation_time_constant": random.uniform(0.03, 0.07),
    }
    stretch = random.uniform(0.8, 1.1)  # of the fibre where the bar stands upright
    path = np.hypot(pendulum.INSERTION, pendulum.ORIGIN)
    tendon = path - stretch * changes["optimal_fiber_length"]
    return [
        dataclasses.replace(muscle, **changes, tendon_slack_length=tendon) for muscle in muscles
    ]


def main():
    print("RMS errors [deg]; the paper prints CMC 0.0025, CSF 0.0186, CSS 0.1146")
    low, high = (
        brentq(lambda kp, e=e: cosimulated(kp, 2 * np.sqrt(kp), False) - e, 100.0, 2000.0)
        for e in (0.01865, 0.01855)
    )
    print(f"CSF prints 0.0186 for kp from {low:.0f} to {high:.0f} 1/s^2, critically damped")
    kv = 2 * np.sqrt(KP)
    csf, css = (cosimulated(KP, kv, predicts) for predicts in (False, True))
    print(f"at kp = {KP:g}: CSF {csf:.4f}, CSS {css:.4f}")
    alone = brentq(lambda kp: cosimulated(kp, 2 * np.sqrt(kp), True) - 0.1146, 100.0, 2000.0)
    print(f"CSS alone prints 0.1146 for kp = {alone:.0f}")
    both = fsolve(
        lambda x: [cosimulated(*x, False) - 0.0186, cosimulated(*x, True) - 0.1146], [500.0, 40.0]
    )
    print(f"both for the pair kp = {both[0]:.1f}, kv = {both[1]:.1f}")
    print("CMC where the torque runs through a window with a mean of")
    for mean in (0.476, 0.49, 0.5, 0.51, 0.526):
        print(f"  {mean:.3f} of its change: {computed(mean):.4f}")
    result = of_run()
    error, mean = np.degrees(result.tracking_error_rms()[0]), mean_within_windows(result)
    print(f"CMC of models/pendulum.py: {error:.4f}, mean {mean:.3f}")
    random, errors = np.random.default_rng(SEED), []
    for _ in range(DRAWS):
        try:
            result = of_run(drawn(random))
        except em.ExudynMusclesError:
            continue
        if result.max_unmet_torque == 0.0 and result.status is em.Status.COMPLETE:
            errors.append(np.degrees(result.tracking_error_rms()[0]))
    low, middle, high = np.percentile(errors, [0, 50, 100])
    below = np.mean(np.array(errors) < 0.0026)
    print(
        f"CMC of {len(errors)} of {DRAWS} random muscles that can do the motion: {low:.4f} to "
        f"{high:.4f}, half of them below {middle:.4f}; {100 * below:.0f} % below 0.0026"
    )


if __name__ == "__main__":
    main()
