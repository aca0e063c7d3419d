"""What a study varies, by name.

| name | is |
|---|---|
| `MUSCLE.FIELD`, `MUSCLE.FIELD.factor` | a number of `Muscle`, or that times its value; `*` and `?` in MUSCLE stand for any letters |
| `mass.LINK`, `mass.LINK.factor` | mass [kg] of a link of a tree (its number or coordinate) or of a rigid body (its name); its inertia changes in the same ratio |
| `settings.FIELD` | a number of the method's settings, such as `settings.kp` |
| `motion.noise` | standard deviation [rad or m] of errors of the motion, drawn anew for every run |
| `source.NAME` | an argument of the function that builds the model |
"""  # noqa: E501

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any

import exudyn as exu
import numpy as np

from ..errors import StudyError
from ..model import MusculoskeletalModel
from ..motion import Motion
from ..muscle.parameters import RANGES, Muscle
from ..skeleton.skeleton import Skeleton
from .noise import NoisyMotion

MUSCLE_FIELDS = (*RANGES, "tendon_strain_at_one_norm_force")
SCOPES = ("mass", "settings", "motion", "source")
# Of a body's parameters, what is proportional to its mass.
BODIES = {
    "RigidBody": ("mass", "inertia"),
    "RigidBody2D": ("mass", "inertia"),
    "MassPoint": ("mass",),
    "MassPoint2D": ("mass",),
}


def check_name(name: str) -> None:
    """Raise StudyError unless this is the name of a parameter, whatever the model has."""
    _, field, _ = _muscle_name(name)
    scope, _, rest = name.partition(".")
    known = field in MUSCLE_FIELDS or (scope in SCOPES and rest != "")
    if not known or (scope == "motion" and rest != "noise"):
        raise StudyError(
            f"parameter '{name}': expected MUSCLE.FIELD or MUSCLE.FIELD.factor with a field of "
            f"{', '.join(MUSCLE_FIELDS)}, or mass.LINK, settings.FIELD, motion.noise, source.NAME"
        )


def of_scope(parameters: Mapping[str, Any], scope: str) -> dict[str, Any]:
    """Those whose names begin with it, without it."""
    return {
        name.partition(".")[2]: value
        for name, value in parameters.items()
        if name.partition(".")[0] == scope and _muscle_name(name)[1] not in MUSCLE_FIELDS
    }


def changed_model(
    model: MusculoskeletalModel, parameters: Mapping[str, float]
) -> MusculoskeletalModel:
    """The model with other masses, which its own system gets, and muscles.

    Raises
    ------
    StudyError
        There is no such muscle or body.
    ParameterError
        A value is outside its range.
    """
    masses = of_scope(parameters, "mass")
    for name, value in masses.items():
        body, factor = (name[:-7], True) if name.endswith(".factor") else (name, False)
        _change_mass(model, body, value, factor)
    muscles = list(model.muscles)
    changes = [(*_muscle_name(name), value) for name, value in parameters.items()]
    changes = [one for one in changes if one[1] in MUSCLE_FIELDS]
    for pattern, field, factor, value in changes:
        muscles = _changed_muscles(muscles, pattern, field, factor, value)
    return model.replace(muscles=muscles) if masses or changes else model


def changed_motion(
    motion: Motion, parameters: Mapping[str, float], seed: np.random.SeedSequence
) -> Motion:
    """The motion with its errors."""
    noise = of_scope(parameters, "motion").get("noise", 0.0)
    if not 0.0 <= noise < np.inf:
        raise StudyError(f"motion.noise = {noise!r} is no standard deviation")
    return NoisyMotion(motion, noise, seed) if noise else motion


def _muscle_name(name: str) -> tuple[str, str, bool]:
    """Pattern, field, and whether it is a factor."""
    factor = name.endswith(".factor")
    pattern, _, field = name.removesuffix(".factor").rpartition(".")
    return pattern, field, factor


def _changed_muscles(
    muscles: list[Muscle], pattern: str, field: str, factor: bool, value: float
) -> list[Muscle]:
    chosen = [fnmatchcase(muscle.name, pattern) for muscle in muscles]
    if not any(chosen):
        raise StudyError(
            f"parameter '{pattern}.{field}': there is no such muscle, only "
            f"{', '.join(muscle.name for muscle in muscles)}"
        )

    def change(muscle: Muscle) -> dict[str, Any]:
        now = muscle.tendon_strain if field.startswith("tendon_strain") else getattr(muscle, field)
        return {field: value * now if factor else value}

    return [
        replace(muscle, **change(muscle)) if is_meant else muscle
        for muscle, is_meant in zip(muscles, chosen, strict=True)
    ]


def _change_mass(model: MusculoskeletalModel, body: str, value: float, factor: bool) -> None:
    if not 0.0 < value < np.inf:
        raise StudyError(f"mass.{body} = {value!r} is no positive number")
    change = _change_links if isinstance(model.skeleton, Skeleton) else _change_bodies
    if not change(model, body, value, factor):
        raise StudyError(f"parameter 'mass.{body}': there is no such link or body that has a mass")


def _change_links(model: MusculoskeletalModel, body: str, value: float, factor: bool) -> bool:
    """Of a tree; whether there was one."""
    skeleton, mbs = model.skeleton, model.mbs
    assert isinstance(skeleton, Skeleton)
    masses = np.array(mbs.GetObjectParameter(skeleton.object, "linkMasses"))
    inertias = mbs.GetObjectParameter(skeleton.object, "linkInertiasCOM")
    scaled, found = exu.Matrix3DList(), False
    for link, name in enumerate(skeleton.tree_coordinates):
        ratio = 1.0
        meant = body == str(link) or fnmatchcase(name, body)
        if meant and masses[link] > 0.0:
            ratio, found = value if factor else value / masses[link], True
        masses[link] *= ratio
        scaled.Append(ratio * np.array(inertias[link]))
    mbs.SetObjectParameter(skeleton.object, "linkMasses", masses)
    mbs.SetObjectParameter(skeleton.object, "linkInertiasCOM", scaled)
    return found


def _change_bodies(model: MusculoskeletalModel, body: str, value: float, factor: bool) -> bool:
    """Of any other system; whether there was one."""
    mbs, found = model.mbs, False
    for number in range(mbs.systemData.NumberOfObjects()):
        item = mbs.GetObject(exu.ObjectIndex(number))
        proportional = BODIES.get(item["objectType"], ())
        if proportional and fnmatchcase(item["name"], body) and item["mass"] > 0.0:
            ratio, found = value if factor else value / item["mass"], True
            for field in proportional:
                scaled = ratio * np.array(item[field])
                mbs.SetObjectParameter(exu.ObjectIndex(number), field, scaled)
    return found
