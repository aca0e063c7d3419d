"""Operators on muscles, of models of any origin: muscles in, changed muscles out, to be chained.

    weaker = operators.scale_max_isometric_force(model.muscles, 0.5, ["soleus_r"])
    rigid = operators.ignore_tendon_compliance(weaker)
    model = model.replace(muscles=rigid)

They do what OpenSim's `ModelOperator`s of similar names do. `names` are the muscles that are
changed, all if left out; ParameterError names one that there is not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from .errors import ParameterError
from .muscle.activation import ActivationDynamics
from .muscle.laws.changed import ChangedLaw
from .muscle.laws.constant_strength import ConstantStrength
from .muscle.laws.law import MuscleLaw
from .muscle.parameters import AT_ONCE, RANGES, Muscle


def ignore_passive_fiber_forces(
    muscles: Iterable[Muscle], names: Iterable[str] | None = None
) -> list[Muscle]:
    """Fibres that bear nothing passively (`ModOpIgnorePassiveFiberForcesDGF`); dampers stay.

    Parameters
    ----------
    muscles : iterable of Muscle
    names : iterable of str, optional
        Muscles that are changed; all if left out.

    Returns
    -------
    list of Muscle
        All of them, in their order.

    Raises
    ------
    ParameterError
        There is no muscle of a name; tells which there are.
    """
    return _changed(
        muscles, names, lambda m: {"law": _like(m.law, ignore_passive_fiber_force=True)}
    )


def scale_active_fiber_force_curve_width(
    muscles: Iterable[Muscle], factor: float, names: Iterable[str] | None = None
) -> list[Muscle]:
    """Fibres that are active over a wider range of lengths
    (`ModOpScaleActiveFiberForceCurveWidthDGF`).

    Parameters
    ----------
    muscles : iterable of Muscle
    factor : float
        At least 1; times the width that they have.
    names : iterable of str, optional
        Muscles that are changed; all if left out.

    Returns
    -------
    list of Muscle
        All of them, in their order.

    Raises
    ------
    ParameterError
        A width is below that of the law or above ten times that, or there is no muscle of a name.
    """

    def wider(muscle: Muscle) -> dict[str, Any]:
        now = getattr(muscle.law, "active_force_width_scale", 1.0)
        return {"law": _like(muscle.law, active_force_width_scale=factor * now)}

    return _changed(muscles, names, wider)


def ignore_tendon_compliance(
    muscles: Iterable[Muscle], names: Iterable[str] | None = None, *, ignore: bool = True
) -> list[Muscle]:
    """Rigid tendons, or elastic ones (`ModOpIgnoreTendonCompliance`).

    Parameters
    ----------
    muscles : iterable of Muscle
    names : iterable of str, optional
        Muscles that are changed; all if left out.
    ignore : bool
        False makes tendons elastic.

    Returns
    -------
    list of Muscle
        All of them, in their order.

    Raises
    ------
    ParameterError
        There is no muscle of a name; tells which there are.
    """
    return _changed(muscles, names, lambda _: {"ignore_tendon_compliance": ignore})


def ignore_physiology(
    muscles: Iterable[Muscle], names: Iterable[str] | None = None
) -> list[Muscle]:
    """Tensions of the activation times F0 at any length and speed, which follow excitations at
    once (`use_muscle_physiology` of OpenSim's static optimization, if it is false).

    Parameters
    ----------
    muscles : iterable of Muscle
    names : iterable of str, optional
        Muscles that are changed; all if left out.

    Returns
    -------
    list of Muscle
        All of them, in their order.

    Raises
    ------
    ParameterError
        There is no muscle of a name; tells which there are.
    """

    def constant(muscle: Muscle) -> dict[str, Any]:
        return {
            "law": ConstantStrength(),
            "ignore_tendon_compliance": True,
            "tendon_slack_length": 0.0,
            "optimal_fiber_length": RANGES["optimal_fiber_length"][1],  # no path is too long
            "pennation_angle_at_optimal": 0.0,
            "tendon_strain_at_one_norm_force": None,
            "activation_dynamics": ActivationDynamics.LINEAR_FILTER,
            "activation_time_constant": AT_ONCE,
            "deactivation_time_constant": AT_ONCE,
        }

    return _changed(muscles, names, constant)


def replace_law(
    muscles: Iterable[Muscle], law: MuscleLaw, names: Iterable[str] | None = None
) -> list[Muscle]:
    """Another law (`ModOpReplaceMusclesWithDeGrooteFregly2016` and others).

    A tendon's own strain stays where the new law has such a number, and the minimum activation is
    at least the usual one where the law divides by it.

    Parameters
    ----------
    muscles : iterable of Muscle
    law : MuscleLaw
        Such as `Millard2012()`.
    names : iterable of str, optional
        Muscles that are changed; all if left out.

    Returns
    -------
    list of Muscle
        All of them, in their order.

    Raises
    ------
    ParameterError
        It is no law, or there is no muscle of a name.
    """
    if not isinstance(law, MuscleLaw):
        raise ParameterError(f"law: a MuscleLaw such as Millard2012() was expected, got {law!r}")

    def changed(muscle: Muscle) -> dict[str, Any]:
        scales = law.tendon_strain_at_one_norm_force is not None
        least = 0.0 if law.bears_no_activation else Muscle.minimum_activation
        return {
            "law": law,
            "tendon_strain_at_one_norm_force": muscle.tendon_strain if scales else None,
            "minimum_activation": max(muscle.minimum_activation, least),
        }

    return _changed(muscles, names, changed)


def scale_max_isometric_force(
    muscles: Iterable[Muscle], factor: float, names: Iterable[str] | None = None
) -> list[Muscle]:
    """Stronger or weaker muscles (`ModOpScaleMaxIsometricForce`).

    Parameters
    ----------
    muscles : iterable of Muscle
    factor : float
        Positive; times the strength that they have.
    names : iterable of str, optional
        Muscles that are changed; all if left out.

    Returns
    -------
    list of Muscle
        All of them, in their order.

    Raises
    ------
    ParameterError
        A strength leaves its range, or there is no muscle of a name.
    """
    return _changed(
        muscles, names, lambda m: {"max_isometric_force": factor * m.max_isometric_force}
    )


def _like(law: MuscleLaw, **changes: Any) -> ChangedLaw:
    return replace(law if isinstance(law, ChangedLaw) else ChangedLaw(law), **changes)


def _changed(
    muscles: Iterable[Muscle],
    names: Iterable[str] | None,
    change: Callable[[Muscle], dict[str, Any]],
) -> list[Muscle]:
    """The muscles, those of these names with other parameters."""
    listed = list(muscles)
    there = [muscle.name for muscle in listed]
    chosen = set(there if names is None else [names] if isinstance(names, str) else names)
    for name in sorted(chosen - set(there)):
        raise ParameterError(f"there is no muscle '{name}', only {', '.join(there)}")
    return [replace(m, **change(m)) if m.name in chosen else m for m in listed]
