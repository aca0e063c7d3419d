"""Muscles at rest: their steady forces in the user's own `mbs.SolveStatic`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import ArrayLike

from ..errors import ModelError, SimulationError
from ..model import MusculoskeletalModel
from ..muscle.equilibrium import equilibrium
from ..simulation.hooks import Hooks
from ..simulation.parameters import keep_parameters
from ..skeleton.constrained import ConstrainedEquations
from ..skeleton.hold import hold
from ..skeleton.reading import original, raise_as_itself
from ..skeleton.skeleton import Skeleton
from ..skeleton.state import State
from .given import activations_of

SOLVER = "staticSolver"  # in mbs.sys
SMALL = 1e-6  # differences of coordinates [rad, m or 1]: their square and rounding are 1e-10


@contextmanager
def muscles_at_rest(
    model: MusculoskeletalModel, activations: float | ArrayLike | Mapping[str, float]
) -> Iterator[None]:
    """Muscles with given activations, fibre and tendon balanced, in the user's `mbs.SolveStatic`:

        with em.muscles_at_rest(model, 0.1):
            mbs.SolveStatic(simulationSettings, updateInitialValues=True)

    The pose that is found is one at which a run with these excitations starts and stays. Ideal
    actuators do nothing. User functions that the `mbs` already has are called first.

    Parameters
    ----------
    model : MusculoskeletalModel
    activations : float, (m,) array_like or mapping of str to float
        Within [0, 1]; below the minimum activations they count as these.

    Raises
    ------
    ParameterError
        The activations do not fit the muscles, or no muscle can be that long.
    ModelError
        Coordinates depend on others in ways that only the model knows, another solver than the
        static one is called, another run is attached, or a user function was replaced.
    SimulationError
        Exudyn found no equilibrium.
    """
    a = activations_of(model, activations)
    mbs, skeleton = model.mbs, model.skeleton
    if not skeleton.known_to_exudyn:
        raise ModelError(
            "SolveStatic does not know the model's dependent_coordinates and cannot hold them"
        )
    with hold(mbs) as held:
        skeleton.open(held)
        hooks = Hooks(mbs)
        if hooks.of_user:
            keep_parameters(mbs, held)
        # What another run has left there must not be taken for this run's solver.
        held.keep(partial(_put_back, mbs, mbs.sys.pop(SOLVER, None)))
        pull, turning = _pull(model, a), _Turning(mbs)
        skeleton.begin(pull())
        held.keep(hooks.restore)

        def before_residual(mbs: exu.MainSystem, *_: Any) -> None:
            # A matrix of another pose is worth little: muscles turn with the skeleton.
            _running(mbs).conv.jacobianUpdateRequested = True
            skeleton.apply(pull())

        def jacobian(mbs: exu.MainSystem, t: float, dq: float, *_: float) -> exu.MatrixContainer:
            return turning.container(dq * turning.slopes(pull, skeleton.rows))

        hooks.install({"PreNewtonResidual": before_residual, "SystemJacobian": jacobian})
        try:
            yield
            hooks.check()
        except BaseException as error:
            raised = original(error)
            if isinstance(raised, exu.ExudynError):
                raise SimulationError(
                    f"Exudyn found no equilibrium, last tried was q = {skeleton.q}: {raised}"
                ) from error
            raise_as_itself(raised, error)


def _pull(model: MusculoskeletalModel, a: np.ndarray) -> Callable[[], np.ndarray]:
    """The function that gives the load of muscles at rest at Exudyn's iterate."""
    skeleton, m, loads_of = model.skeleton, len(model.muscles), model.loads

    def pull() -> np.ndarray:
        if isinstance(skeleton, Skeleton):
            length, _, arms, *_ = model.geometry(*skeleton.place)
        else:
            assert loads_of is not None
            length, _, loads = loads_of(skeleton.pose())
            arms = loads[:m]
        return arms.T @ equilibrium(model.muscles, a, length).force

    return pull


class _Turning:
    """How the forces of muscles and constraints follow the coordinates, which Exudyn's own Newton
    matrix takes for constant."""

    def __init__(self, mbs: exu.MainSystem) -> None:
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        settings.solution.sensors.active = False
        settings.timeIntegration.verboseMode = 0
        settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = False
        solver = exu.MainSolverImplicitSecondOrder()
        solver.InitializeSolver(mbs, settings)
        state = State(mbs, slice(0, mbs.systemData.ODE2Size()))
        self._equations = ConstrainedEquations(mbs, solver, state)
        self._x, self._data = state.current[0], mbs.systemData

    def slopes(self, pull: Callable[[], np.ndarray], rows: slice) -> np.ndarray:
        """Of the muscles' load on these `rows` and of the constraints' forces, over all
        coordinates x (N, N), at the current state."""
        x = self._x
        before, found = x.copy(), np.zeros((x.size, x.size))
        multipliers = np.array(self._data.GetAECoordinates())
        try:
            for j in range(x.size):
                for side in (SMALL, -SMALL):
                    x[j] = before[j] + side
                    found[rows, j] += pull() / (2.0 * side)
                    if multipliers.any():
                        G = self._equations.matrix()[x.size :, : x.size]
                        found[:, j] += multipliers @ G / (2.0 * side)
                x[j] = before[j]
        finally:
            x[:] = before
        return found

    def container(self, slopes: np.ndarray) -> exu.MatrixContainer:
        """These slopes (N, N) in a matrix of the whole system."""
        data, found = self._data, exu.MatrixContainer()
        i, j = np.indices(slopes.shape)
        triplets = np.column_stack([i.ravel(), j.ravel(), slopes.ravel()])
        size = data.ODE2Size() + data.ODE1Size() + data.AEsize()
        found.SetWithSparseMatrix(triplets, size, size)
        return found


def _running(mbs: exu.MainSystem) -> exu.MainSolverStatic:
    """The static solver that calls the user functions."""
    try:
        return mbs.sys[SOLVER]
    except KeyError as error:
        raise ModelError(
            "muscles_at_rest is for mbs.SolveStatic with its default storeSolver=True"
        ) from error


def _put_back(mbs: exu.MainSystem, solver: Any) -> None:
    """Where no run has left another one."""
    if solver is not None:
        mbs.sys.setdefault(SOLVER, solver)
