"""KeyboardInterrupt raised in any line of this package during a run: it comes out as itself, what
was reached can be stored and loaded, and the model runs again, with the same bits."""

import sys
import tempfile
from functools import cache
from pathlib import Path

import numpy as np

import exudyn_muscles as em
from models import pendulum, planar_arm

PACKAGE = str(Path(em.__file__).parent)
SPAN = 0.04  # s
MODELS = {"pendulum": pendulum, "planar_arm": planar_arm}
METHODS = {
    "static": em.static_optimization,
    "cmc": em.computed_muscle_control,
    "csf": em.cosimulate,
    "css": lambda *x: em.cosimulate(*x, settings=em.Cosimulation(scheme=em.Scheme("css"))),
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


class Tracer:
    """Raises KeyboardInterrupt in the package's line number `last` from now on."""

    def __init__(self, last=np.inf):
        self.last, self.lines, self.place = last, 0, ""

    def __call__(self, frame, event, _):
        if not frame.f_code.co_filename.startswith(PACKAGE):
            return None
        if event == "line":
            self.lines += 1
            if self.lines == self.last:
                self.place = f"{frame.f_code.co_filename}, line {frame.f_lineno}"
                raise KeyboardInterrupt
        return self


def traced(tracer, run):
    """The result of a run under a tracer, and the exception that ended it."""
    before = sys.gettrace()
    sys.settrace(tracer)
    try:
        return run(), None
    except BaseException as error:
        return None, error
    finally:
        sys.settrace(before)


def arrays(result):
    return {k: v.tobytes() for k, v in vars(result).items() if isinstance(v, np.ndarray)}


@cache
def reference(name, method):
    """The arrays of a run that nobody interrupts, and its number of lines."""
    model, motion = built(name)
    METHODS[method](model, motion)  # what is done once in a process is done
    tracer = Tracer()
    result, error = traced(tracer, lambda: METHODS[method](model, motion))
    if error is not None:
        raise error
    return arrays(result), tracer.lines


def check(rng):
    name, method = rng.choice(list(MODELS)), rng.choice(list(METHODS))
    expected, lines = reference(name, method)
    model, motion = built(name)
    tracer = Tracer(int(rng.integers(1, lines + 1)))
    _, error = traced(tracer, lambda: METHODS[method](model, motion))
    if not tracer.place:
        return "after the end"
    where = f"{name}, {method}, interrupted in {tracer.place}"
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
