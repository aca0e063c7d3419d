"""Reference windows for test_window.py, drawn by `hill.draw` and integrated by `hill.window`:
neither uses the package's kernels.

Makes `tests/reference/window_box.npz` anew, in some two minutes on one core:

    python -m tests.muscle.make_window_box

"box" are random states of the allowed box, a fourth of them for each law. "ordinary" are states as
a motion meets them: ends of such windows, from where the speed goes on steadily.
"""

from pathlib import Path

import numpy as np

import exudyn_muscles as em
from exudyn_muscles.files.disk import write_arrays

from . import hill

FILE = Path(__file__).parents[1] / "reference" / "window_box.npz"
LAWS = {
    "DeGrooteFregly2016": em.DeGrooteFregly2016(),
    "Thelen2003": em.Thelen2003(),
    "Millard2012": em.Millard2012(),
    "Millard2012, undamped": em.Millard2012(fiber_damping=0.0),
}
PARAMETERS = (
    "max_isometric_force",
    "optimal_fiber_length",
    "tendon_slack_length",
    "pennation_angle_at_optimal",
    "activation_dynamics_smoothing",
)
BOX, ORDINARY = 200, 100  # states of each law
SEED = 2026


def load(kind: str = "box") -> tuple[em.MuscleSet, np.ndarray, np.ndarray]:
    """Muscles, states (a, l_t, u, l_0, v_0, l_1, v_1), (7, k), and ends (a, l_t, F), (3, k).

    `kind` is "box" or "ordinary".
    """
    with np.load(FILE) as file:
        data = dict(file)
    muscles = [
        em.Muscle(
            f"m{k}",
            **dict(zip(PARAMETERS, data["parameters"][number], strict=True)),
            activation_dynamics=em.ActivationDynamics[data["activation_dynamics"][number]],
            law=LAWS[data["law"][number]],
        )
        for k, number in enumerate(data[f"{kind}_muscles"])
    ]
    return em.MuscleSet(muscles), data[f"{kind}_states"].T, data[f"{kind}_ends"].T


def within(muscle: em.Muscle, l_t: float, F: float, l: float) -> bool:
    """Whether a unit is taut and within the box."""
    shortest = max(hill.SHORTEST, hill.curves(muscle).shortest)
    fiber, _ = hill.fiber(muscle, l_t, l)
    return 0.0 < F < 2.0 * muscle.max_isometric_force and shortest < fiber < hill.LONGEST


def main() -> None:
    rng = np.random.default_rng(SEED)
    draws = [hill.draw(rng, law) for law in LAWS.values() for _ in range(BOX)]
    muscles = [muscle for muscle, *_ in draws]
    ends = [hill.window(*draw) for draw in draws]

    ordinary = []
    for first in range(0, len(draws), BOX):
        taut = [
            k for k in range(first, first + BOX) if within(muscles[k], *ends[k][1:], l=draws[k][-2])
        ]
        ordinary += taut[:ORDINARY]
    states = [
        (*ends[k][:2], *hill.course(rng, muscles[k], *draws[k][-2:], change=0.3)) for k in ordinary
    ]
    write_arrays(
        FILE,
        law=np.repeat(list(LAWS), BOX),
        activation_dynamics=[muscle.activation_dynamics.name for muscle in muscles],
        parameters=[[getattr(muscle, name) for name in PARAMETERS] for muscle in muscles],
        box_muscles=np.arange(len(muscles)),
        box_states=[state for _, *state in draws],
        box_ends=ends,
        ordinary_muscles=ordinary,
        ordinary_states=states,
        ordinary_ends=[
            hill.window(muscles[k], *state) for k, state in zip(ordinary, states, strict=True)
        ],
    )


if __name__ == "__main__":
    main()
