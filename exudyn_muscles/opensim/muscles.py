"""Muscles: their numbers and laws."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from ..checks import number_within
from ..muscle.activation import ActivationDynamics
from ..muscle.laws.de_groote_fregly_2016 import DeGrooteFregly2016
from ..muscle.laws.law import MuscleLaw
from ..muscle.laws.meyer_fregly_2016 import MeyerFregly2016
from ..muscle.laws.millard_2012 import Millard2012
from ..muscle.laws.schutte_1993 import Schutte1993
from ..muscle.laws.spline_law import SplineLaw
from ..muscle.laws.thelen_2003 import Thelen2003
from ..muscle.laws.thelen_2003_deprecated import Thelen2003Deprecated
from ..muscle.parameters import AT_ONCE, LEAST_ACTIVATION, Muscle
from .bodies import Bodies
from .element import HARMLESS, ON, UNKNOWN, Element
from .paths import path_tags, read_path


class Class(NamedTuple):
    """A muscle class of OpenSim.

    Attributes
    ----------
    law : type
    activation : ActivationDynamics
    defaults : mapping
        Of what is not our default.
    names : mapping
        Of properties that have another name here.
    numbers : tuple of str
        Properties beside those of every class that are called as here.
    ignored : tuple of str
        Properties that OpenSim does not use.
    splines : mapping
        Of properties that are splines, and our names of their points.
    convert : callable or None
        Puts our parameters in the place of numbers that are none here; raises ParameterError.
    rigid : bool
        Its tendon is rigid whatever a file says.
    """

    law: type[MuscleLaw]
    activation: ActivationDynamics
    defaults: Mapping[str, float]
    names: Mapping[str, str] = {}
    numbers: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()
    splines: Mapping[str, str] = {}
    convert: Callable[[dict[str, Any]], None] | None = None
    rigid: bool = False


def _thelen_deprecated(given: dict[str, Any]) -> None:
    fastest, at_rest = given.pop("Vmax"), given.pop("Vmax0")
    given["max_contraction_velocity"] = number_within("Vmax", fastest, 0.1, 100.0)
    given["speed_without_activation"] = at_rest / fastest


def _millard(given: dict[str, Any]) -> None:
    """The tendon's stiffness is over its strain."""
    stiffness = given.pop("tendon_stiffness_at_one_norm_force", None)
    if stiffness is not None:
        strain = given.get(
            "tendon_strain_at_one_norm_force", Millard2012.tendon_strain_at_one_norm_force
        )
        given["tendon_stiffness"] = stiffness * strain


def _schutte(given: dict[str, Any]) -> None:
    """Its times are in units of `time_scale`, its activation has rates."""
    scale = number_within("time_scale", given.pop("time_scale"), 0.01, 10.0, "s")
    rise = number_within("activation1", given.pop("activation1"), 0.0, 1e4)
    fall = number_within("activation2", given.pop("activation2"), 1e-3, 1e4)
    given["max_contraction_velocity"] = 1.0 / scale
    given["activation_time_constant"] = scale / (rise + fall)
    given["deactivation_time_constant"] = scale / fall


THELEN = {
    "FmaxMuscleStrain": "fmax_muscle_strain",
    "KshapeActive": "kshape_active",
    "KshapePassive": "kshape_passive",
    "Af": "af",
    "Flen": "flen",
}
TIMES = ("activation_time_constant", "deactivation_time_constant")
CLASSES = {
    "Thelen2003Muscle": Class(
        Thelen2003,
        ActivationDynamics.FIRST_ORDER,
        {"activation_time_constant": 0.015, "deactivation_time_constant": 0.050},
        {**THELEN, "FmaxTendonStrain": "tendon_strain_at_one_norm_force"},
        (*TIMES, "minimum_activation", "maximum_pennation_angle", "fv_linear_extrap_threshold"),
    ),
    "Millard2012EquilibriumMuscle": Class(
        Millard2012,
        ActivationDynamics.FIRST_ORDER,
        {"activation_time_constant": 0.010, "deactivation_time_constant": 0.040},
        {
            "FiberForceLengthCurve/strain_at_zero_force": "fiber_strain_at_zero_force",
            "FiberForceLengthCurve/strain_at_one_norm_force": "fiber_strain_at_one_norm_force",
            "FiberForceLengthCurve/stiffness_at_low_force": "fiber_stiffness_at_low_force",
            "FiberForceLengthCurve/stiffness_at_one_norm_force": (
                "fiber_stiffness_at_one_norm_force"
            ),
            "FiberForceLengthCurve/curviness": "fiber_curviness",
            "TendonForceLengthCurve/strain_at_one_norm_force": "tendon_strain_at_one_norm_force",
            "TendonForceLengthCurve/stiffness_at_one_norm_force": (
                "tendon_stiffness_at_one_norm_force"
            ),
            "TendonForceLengthCurve/norm_force_at_toe_end": "norm_force_at_toe_end",
            "TendonForceLengthCurve/curviness": "tendon_curviness",
            **{
                f"ActiveForceLengthCurve/{name}": name
                for name in (
                    "min_norm_active_fiber_length",
                    "transition_norm_fiber_length",
                    "max_norm_active_fiber_length",
                    "shallow_ascending_slope",
                    "minimum_value",
                )
            },
            **{
                f"ForceVelocityCurve/{name}": name
                for name in (
                    "concentric_slope_at_vmax",
                    "concentric_slope_near_vmax",
                    "isometric_slope",
                    "eccentric_slope_at_vmax",
                    "eccentric_slope_near_vmax",
                    "max_eccentric_velocity_force_multiplier",
                    "concentric_curviness",
                    "eccentric_curviness",
                )
            },
        },
        (*TIMES, "minimum_activation", "maximum_pennation_angle", "fiber_damping"),
        convert=_millard,
    ),
    "DeGrooteFregly2016Muscle": Class(
        DeGrooteFregly2016,
        ActivationDynamics.SMOOTH,
        {"activation_time_constant": 0.015, "deactivation_time_constant": 0.060},
        numbers=(
            *TIMES,
            "activation_dynamics_smoothing",
            "tendon_strain_at_one_norm_force",
            "active_force_width_scale",
            "fiber_damping",
            "passive_fiber_strain_at_one_norm_force",
        ),
    ),
    "MeyerFregly2016Muscle": Class(
        MeyerFregly2016,
        ActivationDynamics.SMOOTH,
        {"activation_time_constant": 0.015, "deactivation_time_constant": 0.060},
        numbers=(
            *TIMES,
            "activation_dynamics_smoothing",
            "active_force_width_scale",
            "fiber_damping",
        ),
        rigid=True,
    ),
    # Its activation is its control.
    "RigidTendonMuscle": Class(
        SplineLaw,
        ActivationDynamics.LINEAR_FILTER,
        dict.fromkeys(TIMES, AT_ONCE),
        splines={
            f"{name}_curve": name
            for name in ("active_force_length", "passive_force_length", "force_velocity")
        },
        rigid=True,
    ),
    "Thelen2003Muscle_Deprecated": Class(
        Thelen2003Deprecated,
        ActivationDynamics.LINEAR_FILTER,
        {
            "activation_time_constant": 0.010,
            "deactivation_time_constant": 0.040,
            "Vmax": 10.0,
            "Vmax0": 5.0,
        },
        {**THELEN, "FmaxTendonStrain": "fmax_tendon_strain", "damping": "fiber_damping"},
        (*TIMES, "Vmax", "Vmax0"),
        ignored=("max_contraction_velocity",),
        convert=_thelen_deprecated,
    ),
    "Schutte1993Muscle_Deprecated": Class(
        Schutte1993,
        ActivationDynamics.BILINEAR,
        {"time_scale": 0.1, "activation1": 7.667, "activation2": 1.459854},
        {"damping": "fiber_damping"},
        ("time_scale", "activation1", "activation2"),
        ignored=("max_contraction_velocity", "force_velocity_curve"),
        splines={
            f"{name}_curve": name
            for name in ("active_force_length", "passive_force_length", "tendon_force_length")
        },
        convert=_schutte,
    ),
}
# Before OpenSim 3.
CLASSES["Schutte1993Muscle"] = CLASSES["Schutte1993Muscle_Deprecated"]
DELP = "a mass moves between its fibre and its tendon, which no muscle has here"
# Muscles that cannot be represented, and why.
REFUSED = {"Delp1990Muscle": DELP, "Delp1990Muscle_Deprecated": DELP}
# What every muscle has in OpenSim if its file does not say it.
UNIT = {"max_isometric_force": 1000.0, "optimal_fiber_length": 0.1, "tendon_slack_length": 0.2}
# These only say where a simulation starts and how OpenSim computes it, or nothing: they are left
# over from older classes, and OpenSim 4 does not read them.
WITHOUT_INFLUENCE = (
    "optimal_force", "default_activation", "default_fiber_length",
    "default_normalized_tendon_force", "tendon_compliance_dynamics_mode", "Vmax", "Vmax0",
    "damping", "MuscleFirstOrderActivationDynamicModel",
    "MuscleSecondOrderActivationDynamicModel", "MuscleFixedWidthPennationModel",
    "ForceVelocityInverseCurve",
)  # fmt: skip
# Up to this version of the format the pennation angle has another name.
OLDER = 20301
# Read apart from the numbers.
PASSIVE = "ignore_passive_fiber_force"  # some classes have it
FLAGS = ("ignore_activation_dynamics", PASSIVE, "ignore_tendon_compliance")
CONTROLS = ("min_control", "max_control")
OTHER = (*ON, "isDisabled", *FLAGS, *CONTROLS)
# Of every class, as they are called here.
NUMBERS = (
    "max_isometric_force", "optimal_fiber_length", "tendon_slack_length",
    "pennation_angle_at_optimal", "max_contraction_velocity",
)  # fmt: skip
# OpenSim's minimum activation, and the least control of muscles that have one. It refuses a lower
# one where the activation is divided by.
USUAL_ACTIVATION = 0.01
# Before this version of the format a least control of 0 meant the usual one.
OWN_CONTROL = 30513


def read_muscle(element: Element, bodies: Bodies) -> Muscle:
    """A muscle of a file."""
    kind = CLASSES[element.tag]
    given: dict[str, Any] = {**UNIT, **kind.defaults}
    apart = (*path_tags(element), *OTHER, *HARMLESS)
    for child in element.properties(*kind.splines, *kind.ignored):
        if any(path.startswith(f"{child.tag}/") for path in kind.names):  # a curve
            for inner in child.properties():
                _add_number(kind, inner, given, f"{child.tag}/")
        elif child.tag not in apart:
            _add_number(kind, child, given)
    for name, ours in kind.splines.items():
        if any(name in (child.tag, child.name) for child in element.children):
            given[ours] = _points(element.object(name))
    own = {field.name for field in dataclasses.fields(kind.law)}  # type: ignore[arg-type]
    if PASSIVE in own:
        given[PASSIVE] = element.flag(PASSIVE)
    elif element.find(PASSIVE) is not None:
        element.get(PASSIVE).warn(UNKNOWN)
    activation = kind.activation
    if element.flag("ignore_activation_dynamics"):
        element.get("ignore_activation_dynamics").warn(
            f"activations follow excitations within {1e3 * AT_ONCE:g} ms"
        )
        activation = ActivationDynamics.LINEAR_FILTER
        given |= dict.fromkeys(TIMES, AT_ONCE)
    with element.blamed():
        if kind.convert is not None:
            kind.convert(given)
        law = kind.law(**{name: value for name, value in given.items() if name in own})
        unit = {name: value for name, value in given.items() if name not in own}
        has_none = unit.get("minimum_activation", USUAL_ACTIVATION) < LEAST_ACTIVATION
        unit |= _controls(element, USUAL_ACTIVATION if has_none else 0.0)
        if has_none:
            _keep_activation(element, law, unit)
        muscle = Muscle(
            element.name,
            **unit,
            ignore_tendon_compliance=kind.rigid or element.flag("ignore_tendon_compliance"),
            activation_dynamics=activation,
            law=law,
        )
    points, wraps = read_path(element, bodies)
    return dataclasses.replace(muscle, path=points, wraps=wraps)


def _add_number(kind: Class, element: Element, given: dict[str, Any], where: str = "") -> None:
    """Add a muscle's property to the numbers that are given."""
    if not element.text and not element.children:
        return  # optional
    path = where + element.tag
    name = kind.names.get(path, "" if where else element.tag)
    if name == "pennation_angle" and element.version <= OLDER:
        name = "pennation_angle_at_optimal"
    if path in kind.names or name in (*NUMBERS, *kind.numbers):
        given[name] = float(element.numbers(1)[0])
    elif path not in WITHOUT_INFLUENCE:
        element.warn(UNKNOWN)


def _keep_activation(element: Element, law: MuscleLaw, unit: dict[str, Any]) -> None:
    """Raise a minimum activation that the fibre has to divide by."""
    if not law.bears_no_activation:
        element.get("minimum_activation").warn(
            f"OpenSim refuses less than {USUAL_ACTIVATION:g} for such a fibre, which divides by "
            "the activation; so much is taken here"
        )
        unit["minimum_activation"] = USUAL_ACTIVATION


def _controls(element: Element, lowest: float) -> dict[str, float]:
    """Limits of the excitation, which OpenSim's muscles take as 0 or 1 beyond these."""
    low, high = (
        min(max(element.number(name, usual, infinite=True), 0.0), 1.0)
        for name, usual in zip(CONTROLS, (lowest, 1.0), strict=True)
    )
    if low == 0.0 and element.version < OWN_CONTROL:
        low = lowest
    return {"min_control": low, "max_control": high}


def _points(element: Element) -> tuple[list[float], list[float]]:
    """The points of a muscle's spline."""
    if element.tag != "SimmSpline":
        element.refuse()
    element.allow("x", "y")
    return element.get("x").numbers().tolist(), element.get("y").numbers().tolist()
