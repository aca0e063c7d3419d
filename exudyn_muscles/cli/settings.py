"""From arguments to the methods' settings."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from functools import partial

from ..errors import ParameterError
from ..methods.cmc import CMCSettings, computed_muscle_control
from ..methods.cosimulation import cosimulate
from ..methods.cosimulation_settings import CosimulationSettings, Predictor, Scheme
from ..methods.static import static_optimization
from ..results.trajectory import Trajectory
from .names import TRACKING


def method_function(
    method: str,
    *,
    step: float,
    window: float,
    kp: float,
    kv: float | None,
    predictor: str = "constant",
) -> Callable[..., Trajectory]:
    """The method's function of model, motion and progress=; raises for settings out of range."""
    if method == "static":
        return partial(static_optimization, step=step)
    if method == "cmc":
        cmc = CMCSettings(kp=kp, kv=kv, window=window, step=step)
        return partial(computed_muscle_control, settings=cmc)
    settings = CosimulationSettings(
        scheme=Scheme(method), predictor=Predictor(predictor), kp=kp, kv=kv, step=step
    )
    return partial(cosimulate, settings=settings)


def refuse_foreign_options(arguments: argparse.Namespace) -> None:
    """An option that would be ignored is a mistake."""
    if arguments.sto and arguments.out is None:
        raise ParameterError("--sto needs --out DIR, the folder for its files")
    for option, methods in (
        ("kp", TRACKING),
        ("kv", TRACKING),
        ("window", ("cmc",)),
        ("predictor", ("css",)),
    ):
        if getattr(arguments, option) is not None and arguments.method not in methods:
            raise ParameterError(
                f"--{option} belongs to --method {' or '.join(methods)}, not to {arguments.method}"
            )


def velocity_gain(arguments: argparse.Namespace) -> float:
    """k_v [1/s] as given, or critical damping."""
    return 2.0 * math.sqrt(arguments.kp) if arguments.kv is None else arguments.kv
