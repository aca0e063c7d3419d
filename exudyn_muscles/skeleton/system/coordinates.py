"""What is tracked of a system: joint axes, relative rotations and positions, node coordinates.

Signs: a joint's coordinate is that of its second marker's body as seen from the first one's, about
or along the first one's axis.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass

import exudyn as exu
import numpy as np

from ...checks import item_shown, three_numbers
from ...errors import ParameterError

AXES = ("tx", "ty", "tz", "rx", "ry", "rz")
UNITS = ("rad", "m")


def _index(what: str, value: object, kind: type) -> int:
    """The number of an item of Exudyn.

    Raises
    ------
    ParameterError
        It is one of another list, or none.
    """
    if isinstance(value, kind):
        return int(value)  # type: ignore[call-overload]
    raise ParameterError(f"{what} is the {kind.__name__} of an item, got {item_shown(value)}")


def _unit(what: str, value: str) -> None:
    if value not in UNITS:
        raise ParameterError(f"{what}: unit is one of {', '.join(UNITS)}, got {value!r}")


@dataclass(frozen=True)
class JointCoordinate:
    """A free axis of a joint.

    Parameters
    ----------
    joint : ObjectIndex
        A revolute, prismatic, generic, or planar joint.
    axis : str, optional
        tx, ty, tz, rx, ry or rz of the joint's first marker; may be left out where only one axis is
        free. Several rotations are Tait-Bryan angles, R = R_x R_y R_z.
    """

    joint: exu.ObjectIndex
    axis: str | None = None

    def __post_init__(self) -> None:
        _index("joint", self.joint, exu.ObjectIndex)
        if self.axis is not None and self.axis not in AXES:
            raise ParameterError(f"axis is one of {', '.join(AXES)}, got {self.axis!r}")


@dataclass(frozen=True)
class RelativeRotation:
    """The angle by which one marker's frame is turned against another's about an axis.

    Parameters
    ----------
    marker_0, marker_1 : MarkerIndex
        Of rigid bodies, links or nodes with an orientation.
    axis : (3,) sequence of float
        In the frame of the first marker; any length but zero.
    """

    marker_0: exu.MarkerIndex
    marker_1: exu.MarkerIndex
    axis: Sequence[float] = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        _check_markers(self)


@dataclass(frozen=True)
class RelativePosition:
    """The position of one marker as seen from another, along an axis.

    Parameters
    ----------
    marker_0, marker_1 : MarkerIndex
    axis : (3,) sequence of float
        In the frame of the first marker; any length but zero.
    """

    marker_0: exu.MarkerIndex
    marker_1: exu.MarkerIndex
    axis: Sequence[float] = (1.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        _check_markers(self)


def _check_markers(pair: RelativeRotation | RelativePosition) -> None:
    for name in ("marker_0", "marker_1"):
        _index(name, getattr(pair, name), exu.MarkerIndex)
    axis = np.array(three_numbers("axis", pair.axis))
    length = float(np.linalg.norm(axis))
    if not 0.0 < length < np.inf:
        raise ParameterError("axis has no length")
    object.__setattr__(pair, "axis", tuple((axis / length).tolist()))


@dataclass(frozen=True)
class NodeCoordinate:
    """A coordinate of a node, as a link's of a kinematic tree; without its reference coordinate.

    Parameters
    ----------
    node : NodeIndex
    index : int
        Of the coordinate in the node, from 0.
    unit : str
        rad or m.
    """

    node: exu.NodeIndex
    index: int
    _: KW_ONLY
    unit: str = "rad"

    def __post_init__(self) -> None:
        _index("node", self.node, exu.NodeIndex)
        if isinstance(self.index, bool) or not isinstance(self.index, (int, np.integer)):
            raise ParameterError(f"index is an integer from 0, got {self.index!r}")
        _unit("node coordinate", self.unit)


@dataclass(frozen=True)
class ScalarFunction:
    """Any scalar of the system's state.

    Parameters
    ----------
    value : callable
        mbs -> float, at its current state.
    rate : callable
        mbs -> (N,) array, by which the system's N speeds x' are multiplied for the rate of the
        value, at its current state.
    unit : str
        rad or m.
    """

    value: Callable[[exu.MainSystem], float]
    rate: Callable[[exu.MainSystem], np.ndarray]
    _: KW_ONLY
    unit: str = "rad"

    def __post_init__(self) -> None:
        for name in ("value", "rate"):
            if not callable(getattr(self, name)):
                raise ParameterError(
                    f"{name} is a function of the mbs, got {getattr(self, name)!r}"
                )
        _unit("scalar function", self.unit)


Tracked = JointCoordinate | RelativeRotation | RelativePosition | NodeCoordinate | ScalarFunction
