"""Muscles by what a dynamometer measures: tendon slack lengths and strengths from torques at known
activations, passive ones among them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..errors import ParameterError, SimulationError
from ..model import MusculoskeletalModel
from ..muscle.equilibrium import equilibrium
from ..muscle.parameters import L_TS, Muscle, MuscleSet
from ..skeleton.skeleton import Skeleton

# How far a value may go from that of the model, as factors: tendons of the same muscle differ by
# some tenths, strengths of athletes and patients several times.
SLACK, STRENGTH = (0.6, 1.6), (0.05, 20.0)
EXACT = 1e-13  # of least squares, whose residuals have all their digits
DIFFERENCE = 1e-6  # of a slack length, where fibres move


@dataclass(frozen=True, eq=False)
class TorqueRecord:
    """Torques in k poses or at k times.

    Attributes
    ----------
    coordinates : (k, n) ndarray
        Of the model [rad or m].
    torques : (k, n) ndarray
        Of the muscles, by generalized coordinates [N m or N], NaN where nothing was measured.
        Gravity and inertia have been taken off.
    activations : (k, m) ndarray, optional
        Of all muscles, such as normalised EMG after its activation dynamics; left out, all are
        passive, at their minimum activation.
    speeds : (k, n) ndarray, optional
        Coordinates' speeds; at rest if left out. In a moving unit fibre and tendon share the speed
        by their compliances, as `equilibrium` has it.
    """

    coordinates: np.ndarray
    torques: np.ndarray
    activations: np.ndarray | None = None
    speeds: np.ndarray | None = None


class Identified(NamedTuple):
    """What was found.

    Attributes
    ----------
    muscles : list of Muscle
        For `model.replace`.
    parameters : tuple of str
        `soleus.tendon_slack_length` and so on.
    values, standard_errors : ndarray
        In their units; errors are those of a linear fit, infinite for what the record does not
        determine.
    rms : float
        Root mean square of the torques that are left [N m or N].
    """

    muscles: list[Muscle]
    parameters: tuple[str, ...]
    values: np.ndarray
    standard_errors: np.ndarray
    rms: float


def identify(
    model: MusculoskeletalModel,
    record: TorqueRecord,
    *,
    slack_lengths: Iterable[str] = (),
    strengths: Iterable[str] = (),
) -> Identified:
    """Find slack lengths and strengths by least squares, with exact derivatives at rest.

    With l_t the tendon of the balance of fibre and tendon and k = dF/dl its stiffness, F grows by
    F / F0 with F0 and by -k l_t / l_ts with l_ts.

    Parameters
    ----------
    model : MusculoskeletalModel
        On a kinematic tree; its muscles are where the search begins.
    record : TorqueRecord
    slack_lengths, strengths : iterable of str
        Muscles whose tendon_slack_length, or max_isometric_force, is sought.

    Returns
    -------
    Identified

    Raises
    ------
    ParameterError
        The record does not fit the model, there is no such muscle, or fewer torques than unknowns.
    SimulationError
        The search did not end.
    """
    from scipy.optimize import least_squares  # slow to import

    slack, strong = _numbers(model, slack_lengths), _numbers(model, strengths)
    torques = _Torques(model, record, slack, strong)
    low, high = np.array([SLACK] * len(slack) + [STRENGTH] * len(strong)).T
    found = least_squares(
        torques.residuals, np.ones(low.size), torques.jacobian, (low, high),
        x_scale="jac", ftol=EXACT, xtol=EXACT, gtol=EXACT, max_nfev=500,
    )  # fmt: skip
    if not found.success:
        raise SimulationError(f"identification: {found.message}")
    muscles = torques.muscles(found.x)
    start = [torques.initial[i].tendon_slack_length for i in slack]
    start += [torques.initial[i].max_isometric_force for i in strong]
    names = [f"{torques.initial[i].name}.tendon_slack_length" for i in slack]
    names += [f"{torques.initial[i].name}.max_isometric_force" for i in strong]
    rest = found.fun.size - low.size
    variance = found.fun @ found.fun / rest if rest else 0.0
    errors = _errors(found.jac, variance)
    rms = float(np.sqrt(np.mean(np.square(found.fun))))
    scale = np.array(start)
    return Identified(muscles, tuple(names), scale * found.x, scale * errors, rms)


class _Torques:
    """Torques of a model's muscles in the poses of a record, by factors of the unknowns."""

    def __init__(
        self, model: MusculoskeletalModel, record: TorqueRecord, slack: list[int], strong: list[int]
    ) -> None:
        q, measured = (np.asarray(x, dtype=float) for x in (record.coordinates, record.torques))
        m, n = len(model.muscles), len(model.coordinates)
        if not isinstance(model.skeleton, Skeleton):
            raise ParameterError("identification: a model on a kinematic tree was expected")
        v = np.zeros_like(q) if record.speeds is None else np.asarray(record.speeds, dtype=float)
        a = np.zeros((len(q), m)) if record.activations is None else np.asarray(record.activations)
        given = {"coordinates": q, "torques": measured, "speeds": v, "activations": a}
        for name, values in given.items():
            shape = len(q), m if name == "activations" else n
            if values.shape != shape:
                raise ParameterError(f"record: {name} {shape} were expected, got {values.shape}")
            if name != "torques" and not np.isfinite(values).all():
                raise ParameterError(f"record: {name} have values that are no numbers")
        if not ((a >= 0.0) & (a <= 1.0)).all():
            raise ParameterError(
                f"record: activations from {a.min():g} to {a.max():g} are outside [0, 1]"
            )
        a = np.maximum(a, model.muscles.minimum_activation)
        self.initial = list(model.muscles)
        self._slack, self._strong = slack, strong
        self._known = np.isfinite(measured)
        unknowns = len(slack) + len(strong)
        if not 0 < unknowns <= np.count_nonzero(self._known):
            raise ParameterError(f"{np.count_nonzero(self._known)} torques for {unknowns} unknowns")
        self._measured, self._a, self._moves = measured, a, bool(v.any())
        places = [model.geometry(*at) for at in zip(q, v, strict=True)]
        self._arms = np.array([place.moment_arms for place in places])  # (k, m, n)
        self._lengths = np.array([place.length for place in places])
        self._speeds = np.array([place.lengthening_speed for place in places])

    def muscles(self, x: np.ndarray) -> list[Muscle]:
        """With the factors `x` of slack lengths and then of strengths."""
        changed = list(self.initial)
        for i, factor in zip(self._slack, x, strict=False):
            l_ts = float(factor * changed[i].tendon_slack_length)
            changed[i] = replace(changed[i], tendon_slack_length=l_ts)
        for i, factor in zip(self._strong, x[len(self._slack) :], strict=True):
            strength = float(factor * changed[i].max_isometric_force)
            changed[i] = replace(changed[i], max_isometric_force=strength)
        return changed

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """Torques less measured ones."""
        F, _ = self._forces(MuscleSet(self.muscles(x)))
        return (np.einsum("kmn,km->kn", self._arms, F) - self._measured)[self._known]

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Their derivatives by the factors."""
        F, by_slack = self._forces(MuscleSet(self.muscles(x)))
        if self._moves:
            step = np.where(np.arange(x.size) < len(self._slack), DIFFERENCE, 0.0)
            sides = [self._forces(MuscleSet(self.muscles(x + s * step)))[0] for s in (1.0, -1.0)]
            slack = (sides[0] - sides[1])[:, self._slack] / (2.0 * DIFFERENCE)
        else:
            before = [self.initial[i].tendon_slack_length for i in self._slack]
            slack = by_slack[:, self._slack] * before
        strong = F[:, self._strong] / x[len(self._slack) :]
        changes = np.concatenate([slack, strong], axis=1)  # (k, unknowns)
        arms = self._arms[:, [*self._slack, *self._strong]]
        return (arms * changes[:, :, None]).transpose(0, 2, 1)[self._known]

    def _forces(self, muscles: MuscleSet) -> tuple[np.ndarray, np.ndarray]:
        """F (k, m) [N], and at rest dF/dl_ts [N/m]."""
        l_ts = muscles.tables.table[:, L_TS]
        found = [
            equilibrium(muscles, a, l, l_rate)
            for a, l, l_rate in zip(self._a, self._lengths, self._speeds, strict=True)
        ]
        slopes = [-one.stiffness * one.tendon_length / l_ts for one in found]
        return np.array([one.force for one in found]), np.array(slopes)


def _numbers(model: MusculoskeletalModel, names: Iterable[str]) -> list[int]:
    if isinstance(names, str):
        raise ParameterError(f"names of muscles, such as ['{names}'], were expected, got '{names}'")
    there, chosen = model.muscles.names, list(names)
    for name in chosen:
        if name not in there:
            raise ParameterError(f"there is no muscle '{name}', only {', '.join(there)}")
    return [there.index(name) for name in dict.fromkeys(chosen)]


def _errors(jacobian: np.ndarray, variance: float) -> np.ndarray:
    """Standard errors; infinite in the directions in which nothing changes."""
    _, sizes, directions = np.linalg.svd(jacobian, full_matrices=False)
    known = sizes > sizes.max(initial=0.0) * max(jacobian.shape) * np.finfo(float).eps
    inverse = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=known)
    errors = np.sqrt(variance * np.sum((directions.T * inverse) ** 2, axis=1))
    blind = np.sum(directions[~known] ** 2, axis=0) > np.sqrt(np.finfo(float).eps)
    return np.where(blind, np.inf, errors)
