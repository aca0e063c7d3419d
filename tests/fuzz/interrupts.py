"""KeyboardInterrupt raised in any line of Python during a run: it comes out as itself, what
was reached can be stored and loaded, and the model runs again, with the same bits."""

import tempfile
from functools import cache
from pathlib import Path

import numpy as np

import exudyn_muscles as em
from models import pendulum, planar_arm

from ..interrupts import traced

SPAN = 0.04  # s
MODELS = {"pendulum": pendulum, "planar_arm": planar_arm}
METHODS = {
    "static": em.static_optimization,
    "cmc": em.computed_muscle_control,
    "csf": em.cosimulate,
    "css": lambda *x: em.cosimulate(*x, settings=em.CosimulationSettings(scheme=em.Scheme("css"))),
    "forward": lambda model, motion: em.forward_dynamics(model, excitations(model)),
}


@cache
def built(name):
    """A model and the start of its motion."""
    source = MODELS[name]
    motion = source.motion()
    return source.build(), motion.between(motion.start, motion.start + SPAN)


@cache
def excitations(model):
    times = np.linspace(0.0, SPAN, 5)
    return em.Excitations(times, np.full((4, len(model.muscles)), 0.2))


def arrays(result):
    return {k: v.tobytes() for k, v in vars(result).items() if isinstance(v, np.ndarray)}


@cache
def reference(name, method):
    """The arrays of a run that nobody interrupts, and its number of lines."""
    model, motion = built(name)
    METHODS[method](model, motion)  # what is done once in a process is done
    with traced() as tracer:
        result = METHODS[method](model, motion)
    return arrays(result), len(tracer.lines)


def check(rng):
    name, method = rng.choice(list(MODELS)), rng.choice(list(METHODS))
    expected, lines = reference(name, method)
    model, motion = built(name)
    error = None
    try:
        with traced(int(rng.integers(lines))) as tracer:
            METHODS[method](model, motion)
    except BaseException as raised:
        error = raised
    where = "{}, {}, interrupted in {}, line {}".format(name, method, *tracer.lines[-1])
    try:
        if error is None:
            raise AssertionError(f"{where}: it was swallowed")
        if not isinstance(error, KeyboardInterrupt):
            raise AssertionError(f"{where}: it came out as {error!r}") from error
        partial = getattr(error, "trajectory", None)
        if partial is not None:
            with tempfile.TemporaryDirectory() as folder:
                file = Path(folder) / "partial.npz"
                partial.save(file)
                again = em.Trajectory.load(file)
            assert arrays(again) == arrays(partial), f"{where}: another result after loading"
        try:
            result = METHODS[method](model, motion)
        except Exception as refused:
            raise AssertionError(f"{where}: then {refused!r}") from refused
        assert arrays(result) == expected, f"{where}: other bits afterwards"
    except Exception:
        built.cache_clear()  # the next case gets a model that works
        raise
    return "with a part of the result" if partial is not None else "before there was a result"
