"""By which method the runs of a study are made, and with which settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

from ..errors import StudyError
from ..methods.cmc import CMCSettings, computed_muscle_control
from ..methods.cosimulation import cosimulate
from ..methods.cosimulation_settings import CosimulationSettings, Scheme
from ..methods.static import StaticSettings, static_optimization
from ..opensim.cmc_setup import CMCSetup
from ..opensim.static_setup import StaticSetup
from ..results.trajectory import Trajectory
from .source import Subject

SCHEMES = {scheme.value: scheme for scheme in Scheme}
SETTINGS: dict[str, Any] = {
    "static": StaticSettings,
    "cmc": CMCSettings,
    **dict.fromkeys(SCHEMES, CosimulationSettings),
}


@dataclass(frozen=True)
class Method:
    """A method by its name.

    Parameters
    ----------
    name : str, optional
        `static`, `cmc`, `csf`, `css` or `consistent`. Left out, that of a set-up file, and
        `consistent` without one.
    settings : mapping
        Fields of its settings that are not the usual ones, or not those of the set-up file.

    Raises
    ------
    StudyError
        There is no such method or field.
    """

    name: str | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.name is not None and self.name not in SETTINGS:
            raise StudyError(f"method '{self.name}' is none of {', '.join(SETTINGS)}")
        kinds = SETTINGS.values() if self.name is None else [SETTINGS[self.name]]
        known = {each.name for kind in kinds for each in fields(kind)} - {"scheme"}
        for name in self.settings:
            if name not in known:
                raise StudyError(f"settings: there is no '{name}', only {', '.join(sorted(known))}")


def run_method(method: Method, subject: Subject) -> Trajectory:
    """The result of the method.

    Raises
    ------
    StudyError
        The set-up file is not one of this method.
    ExudynMusclesError
        As the method does.
    """
    model, motion, _, setup = subject
    name = method.name or _usual_name(setup)
    settings = replace(_usual_settings(name, setup), **method.settings)
    if name == "static":
        return static_optimization(model, motion, settings=settings)
    if name == "cmc":
        return computed_muscle_control(model, motion, settings=settings)
    return cosimulate(model, motion, settings=settings)


def _usual_name(setup: CMCSetup | StaticSetup | None) -> str:
    if setup is None:
        return Scheme.CONSISTENT.value
    return "cmc" if isinstance(setup, CMCSetup) else "static"


def _usual_settings(name: str, setup: CMCSetup | StaticSetup | None) -> Any:
    if setup is None:
        usual = SETTINGS[name]()
        return replace(usual, scheme=SCHEMES[name]) if name in SCHEMES else usual
    if (name == "static") != isinstance(setup, StaticSetup):
        raise StudyError(f"a set-up of {_usual_name(setup)} is not run by {name}")
    return setup.cosimulation(SCHEMES[name]) if name in SCHEMES else setup.settings  # type: ignore[union-attr]
