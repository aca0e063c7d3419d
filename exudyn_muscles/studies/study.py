"""A study, its runs, and the rows that they become."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import Any

import numpy as np

from ..errors import StudyError
from .identity import digest
from .method import Method
from .outcomes import Function, Outcome
from .parameters import of_scope
from .samples import Samples
from .source import Source

USUAL = ("max_unmet_torque",)


@dataclass(frozen=True)
class Run:
    """One run of a study, as it is sent to another process."""

    number: int
    source: Source
    method: Method
    parameters: Mapping[str, float]
    outcomes: tuple[Outcome, ...]
    seed: int
    keeps_trajectory: bool = False

    @property
    def random(self) -> np.random.SeedSequence:
        """Of this run, whoever makes it."""
        return np.random.SeedSequence([self.seed, self.number])


@dataclass(frozen=True)
class Row:
    """What became of a run.

    Attributes
    ----------
    number : int
    status : str
        `complete`, `incomplete`, `lost` as of a trajectory; `failed` if an exception ended it,
        `died` if its process did.
    outcomes : tuple of float
        NaN where there is none.
    message : str
        Of the exception, or of the trajectory.
    warnings : str
    """

    number: int
    status: str
    outcomes: tuple[float, ...]
    message: str = ""
    warnings: str = ""


@dataclass(frozen=True, eq=False)
class Study:
    """Sources, with every sample of their parameters, by one method.

    Parameters
    ----------
    source : Source or sequence of Source
        Such as Builder, PythonFile, OsimFile, SetupFile, SystemDescription.
    samples : Samples, optional
        One run of each source with everything as it is, if left out.
    method : Method or str, optional
    outcomes : mapping or sequence
        Name -> what, or texts that are names as well; see `studies.outcomes`.
    seed : int
        Of what is drawn in the runs.
    trajectories : bool
        Keep every result, as a file beside the table.

    Raises
    ------
    StudyError
        There is no run, no outcome or no such thing.
    """

    source: Source | Sequence[Source]
    samples: Samples = field(default_factory=Samples.single)
    method: Method | str = field(default_factory=Method)
    outcomes: Mapping[str, str | Function] | Sequence[str] = USUAL
    seed: int = 0
    trajectories: bool = False

    def __post_init__(self) -> None:
        if not self.size:
            raise StudyError("a study without runs: there is no source, or no sample")
        if not self.columns:
            raise StudyError("a study without outcomes")
        self.run(0)  # is there such a method, and are there such settings?

    @property
    def sources(self) -> tuple[Source, ...]:
        """All of them."""
        given = self.source
        return tuple(given) if isinstance(given, Sequence) else (given,)

    @property
    def columns(self) -> tuple[Outcome, ...]:
        """The outcomes, of which each is a column of the table."""
        given = self.outcomes
        named = given.items() if isinstance(given, Mapping) else zip(given, given, strict=True)
        return tuple(Outcome(name, what) for name, what in named)

    @property
    def size(self) -> int:
        """Number of runs."""
        return len(self.sources) * len(self.samples)

    def run(self, number: int) -> Run:
        """A run by its number: the samples of the first source, then those of the next.

        Parameters
        ----------
        number : int

        Returns
        -------
        Run
        """
        which, sample = divmod(number, len(self.samples))
        values = self.samples.values[sample].tolist()
        parameters = dict(zip(self.samples.names, values, strict=True))
        return self.run_with(parameters, number, self.sources[which])

    def run_with(
        self, parameters: Mapping[str, float], number: int = 0, source: Source | None = None
    ) -> Run:
        """A run with parameters, of which those of source and settings are put there.

        Parameters
        ----------
        parameters : mapping of str to float
        number : int
            Of the run, by which it draws its noise.
        source : Source, optional
            The first one if left out.

        Returns
        -------
        Run
        """
        source = source or self.sources[0]
        method = Method(self.method) if isinstance(self.method, str) else self.method
        changed = {**method.settings, **of_scope(parameters, "settings")}
        return Run(
            number,
            source.given(of_scope(parameters, "source")),
            Method(method.name, changed),
            dict(parameters),
            self.columns,
            self.seed,
            self.trajectories,
        )

    def identity(self) -> dict[str, Any]:
        """What tells it from another study, by parts.

        Returns
        -------
        dict
            Name of a part -> what it is, or its digest.
        """
        return {
            "source": digest([source.identity for source in self.sources]),
            "samples": digest([self.samples.names, self.samples.values]),
            "method": digest(self.method),
            "outcomes": digest(self.columns),
            "seed": self.seed,
            "trajectories": self.trajectories,
            "version": version("exudyn_muscles"),
        }
