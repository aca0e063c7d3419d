"""One run of a study, in whatever process."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from threading import Lock

from ..errors import LONGEST_WORD, ExudynMusclesWarning, cut
from ..results.trajectory import Trajectory
from .method import run_method
from .outcomes import values
from .parameters import changed_model, changed_motion, check_name
from .source import Subject
from .study import Row, Run, Study

# Neither Exudyn nor Python's warnings are for several threads of a process.
_ONE_AT_A_TIME = Lock()


def compute(run: Run) -> tuple[Row, Trajectory | None]:
    """The row of a run, and its trajectory if it is kept; what fails is in the row.

    The linear algebra of NumPy has one thread meanwhile: with several the last bits would be
    others, and workers would take each other's cores.
    """
    from threadpoolctl import threadpool_limits

    nothing = (math.nan,) * len(run.outcomes)
    with _ONE_AT_A_TIME, threadpool_limits(1), warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            subject, result = _result(run)
            found = values(run.outcomes, subject.model, result)
        except Exception as error:  # of the model's own code, too
            text = f"{type(error).__name__}: {error}"
            return Row(run.number, "failed", nothing, text, _texts(said)), None
    status, message = result.status.name.lower(), result.message
    row = Row(run.number, status, found, message, _texts(said))
    return row, result if run.keeps_trajectory else None


def evaluate(study: Study, parameters: Mapping[str, float]) -> dict[str, float]:
    """Outcomes of one run of the study's first source, for optimizers and other hosts, such as
    Exudyn's `ParameterVariation` and `GeneticOptimization`.

    Parameters
    ----------
    study : Study
        Its samples do not matter.
    parameters : mapping
        Name -> value.

    Returns
    -------
    dict of str to float
        Name of an outcome -> its value.

    Raises
    ------
    StudyError
        A name is that of no parameter.
    ExudynMusclesError
        As the run does.
    """
    for name in parameters:
        check_name(name)
    run = study.run_with(parameters)
    subject, result = _result(run)
    names = (outcome.name for outcome in run.outcomes)
    return dict(zip(names, values(run.outcomes, subject.model, result), strict=True))


def _result(run: Run) -> tuple[Subject, Trajectory]:
    subject = run.source.load()
    model = changed_model(subject.model, run.parameters)
    motion = changed_motion(subject.motion, run.parameters, run.random)
    subject = subject._replace(model=model, motion=motion)
    return subject, run_method(run.method, subject)


def _texts(said: list[warnings.WarningMessage]) -> str:
    """Each different one of this package once, by its kind and first words. Others come from
    libraries, and say more of a process than of a run."""
    said = [each for each in said if issubclass(each.category, ExudynMusclesWarning)]
    texts = [
        f"{each.category.__name__}: {cut(str(each.message), 4 * LONGEST_WORD)}" for each in said
    ]
    return "; ".join(dict.fromkeys(texts))
