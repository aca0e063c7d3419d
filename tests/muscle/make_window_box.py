"""Reference forces for test_window.py: random windows of the allowed box, integrated by Radau.

Makes `tests/reference/window_box.npz` anew, in some three minutes on one core:

    python -m tests.muscle.make_window_box

`hill.draw` draws the states and `hill.window` integrates them (`solve_ivp`, Radau, rtol 1e-11):
neither uses the package's kernels.
"""

from pathlib import Path

import numpy as np

from . import hill

FILE = Path(__file__).parents[1] / "reference" / "window_box.npz"
PARAMETERS = (
    "max_isometric_force",
    "optimal_fiber_length",
    "tendon_slack_length",
    "pennation_angle_at_optimal",
)
COUNT = 600
SEED = 2026


def main() -> None:
    rng = np.random.default_rng(SEED)
    draws = [hill.draw(rng) for _ in range(COUNT)]
    np.savez(
        FILE,
        # One row a state: the muscle's parameters; a, F, u, l_0, v_0, l_1, v_1; force at the end.
        parameters=[[getattr(muscle, name) for name in PARAMETERS] for muscle, *_ in draws],
        states=[state for _, *state in draws],
        force=[hill.window(*draw) for draw in draws],
    )


if __name__ == "__main__":
    main()
