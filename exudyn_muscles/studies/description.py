"""An Exudyn system as a value: its own dictionary, with Exudyn's lists as arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import exudyn as exu
import numpy as np

from ..errors import StudyError
from ..model import MusculoskeletalModel
from ..motion import Motion
from ..muscle.parameters import Muscle
from ..skeleton.skeleton import Skeleton
from .identity import digest
from .source import Subject

LISTS = {"Vector3DList": exu.Vector3DList, "Matrix3DList": exu.Matrix3DList}


@dataclass(frozen=True, eq=False)
class SystemDescription:
    """A model as it is in this process, for others.

    Attributes
    ----------
    name : str
    system : mapping
        What `mbs.GetDictionary()` says; user functions are kept if they can be pickled.
    tree : int or mapping
        As of `MusculoskeletalModel`.
    muscles : tuple of Muscle
    options : mapping
        Further arguments of `MusculoskeletalModel`.
    motion : Motion
    """

    name: str
    system: Mapping[str, Any]
    tree: Any
    muscles: tuple[Muscle, ...]
    options: Mapping[str, Any]
    motion: Motion

    @classmethod
    def of(
        cls, model: MusculoskeletalModel, motion: Motion, name: str = "model"
    ) -> SystemDescription:
        """Describe a model on a kinematic tree.

        Parameters
        ----------
        model : MusculoskeletalModel
        motion : Motion
        name : str

        Returns
        -------
        SystemDescription

        Raises
        ------
        StudyError
            It is on bodies, whose coordinates are given by items of its own `mbs`: their source is
            a Builder.
        """
        skeleton = model.skeleton
        if not isinstance(skeleton, Skeleton):
            raise StudyError(
                "a model of bodies and joints is built anew by its function: use studies.Builder"
            )
        options = {
            "coordinates": skeleton.tree_coordinates,
            "dependent_coordinates": model.dependent_coordinates,
            "loops": model.loops,
            "reserves": model.reserves,
        }
        system = _plain(model.mbs.GetDictionary())
        return cls(name, system, int(skeleton.object), tuple(model.muscles), options, motion)

    @property
    def identity(self) -> str:
        """By all of it."""
        return digest([self.system, self.tree, self.muscles, self.options, self.motion])

    def load(self) -> Subject:
        """The model on a new system.

        Returns
        -------
        Subject
        """
        mbs = exu.SystemContainer().AddSystem()
        mbs.SetDictionary(_lists(self.system))
        mbs.Assemble()
        model = MusculoskeletalModel(mbs, exu.ObjectIndex(self.tree), self.muscles, **self.options)
        return Subject(model, self.motion)

    def given(self, arguments: Mapping[str, Any]) -> SystemDescription:
        """Itself, as there are no functions.

        Parameters
        ----------
        arguments : mapping

        Returns
        -------
        SystemDescription

        Raises
        ------
        StudyError
            There are arguments.
        """
        if arguments:
            raise StudyError(f"{self.name} is built by no function with {', '.join(arguments)}")
        return self


def _plain(value: Any) -> Any:
    """Exudyn's lists, which cannot be pickled, as pairs of their kind and arrays."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    kind = type(value).__name__
    return (
        {"exudyn list": kind, "items": [np.array(value[i]) for i in range(len(value))]}
        if kind in LISTS
        else value
    )


def _lists(value: Any) -> Any:
    """The inverse of `_plain`."""
    if isinstance(value, Mapping):
        if "exudyn list" in value:
            made = LISTS[value["exudyn list"]]()
            for item in value["items"]:
                made.Append(item)
            return made
        return {key: _lists(item) for key, item in value.items()}
    return [_lists(item) for item in value] if isinstance(value, list) else value
