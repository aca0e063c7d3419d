"""Bodies, frames and joints as links of a tree.

A joint becomes as many links as it has axes that move, all but the last without mass. A body is
fixed to the last of them, or to its parent's link if the joint is a weld. Links whose axes are
functions of a coordinate follow the link that has this coordinate itself: one of the joint's axes,
or else a slider apart that carries nothing.
"""

from __future__ import annotations

from collections import Counter
from itertools import chain
from typing import NamedTuple

import numpy as np

from ..numerics.products import SumOfProducts
from ..path.frames import GROUND
from ..skeleton.coupling import DependentCoordinate, linear_function
from ..skeleton.tree import PRISMATIC
from .couplers import Coupler, read_couplers
from .element import Element
from .frame_set import GROUND_PATH, PARTS, FrameSet, body_path
from .frames import ZERO, Place, aligned, moved, pose
from .functions import Line, as_curve, without_locked
from .joints import Axis, Coordinate, joint_path, read_axes

# From this version of the format on an inertia is one property; before, what a file left out of it
# was this [kg m^2].
ONE_INERTIA = 30500
OLD_INERTIA = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)


class Inertia(NamedTuple):
    """Mass [kg], first moment m c (3,) and inertia (3, 3) about the origin of a link's frame."""

    mass: float
    moment: np.ndarray
    tensor: np.ndarray

    def plus(self, mass: float, center: np.ndarray, tensor: np.ndarray) -> Inertia:
        """With a body, from its mass, its center and its inertia about that."""
        spread = (center @ center) * np.eye(3) - np.outer(center, center)
        return Inertia(
            self.mass + mass, self.moment + mass * center, self.tensor + tensor + mass * spread
        )


class Link(NamedTuple):
    """A link of the tree and its joint.

    Attributes
    ----------
    joint : int
        0, 1, 2: revolute about the local x, y, z axis; 3, 4, 5: prismatic.
    parent : int
        -1 for ground.
    frame : (4, 4) ndarray
        Of the joint, in the parent's.
    name : str
        Of the link's coordinate: that of `coordinate`, or of an axis that is a function of it.
    coordinate : Coordinate
    follows : DependentCoordinate or None
        None: the link's coordinate is independent.
    inertia : Inertia
    """

    joint: int
    parent: int
    frame: np.ndarray
    name: str
    coordinate: Coordinate
    follows: DependentCoordinate | None
    inertia: Inertia


class End(NamedTuple):
    """A joint between the paths of two bodies, with its frame (4, 4) on either."""

    joint: Element
    parent: str
    before: np.ndarray
    child: str
    behind: np.ndarray
    is_reversed: bool = False

    @property
    def reversed(self) -> End:
        """The same joint seen from its child."""
        return End(
            self.joint, self.child, self.behind, self.parent, self.before, not self.is_reversed
        )


class Bodies:
    """The bodies of a model, joined to links.

    Attributes
    ----------
    links : list of Link
    coordinates : list of Coordinate
        All that the file has.
    locked : dict of str to float
        The values of those that are held.
    places : dict of str to Place
        Of ground and the bodies, by their paths (`/ground`, `/bodyset/femur`).
    wraps : dict of str to list of (Element, Place)
        Surfaces by their names, with the frames that they are given in.
    """

    def __init__(self, model: Element) -> None:
        self.links: list[Link] = []
        self.coordinates: list[Coordinate] = []
        self.places = {GROUND_PATH: Place(GROUND, np.eye(4))}
        self._frames = FrameSet(model)
        bodies = model.items("BodySet")
        joints = model.items("JointSet")
        for joint in joints:
            self._frames.add(joint_path(joint), joint.items("frames"))
        self._frames.check()
        for body in bodies:
            joints += body.items("Joint")  # before version 4
        self._join([self._end(joint) for joint in joints])
        self.locked = {each.name: each.default_value for each in self.coordinates if each.locked}
        self._couple(read_couplers(model))
        for body in bodies:
            path = body_path(body.name)
            if path not in self.places:
                raise body.error("no joint leads to it")
            self._add_inertia(self.places[path], body)
        for name, count in Counter(coordinate.name for coordinate in self.coordinates).items():
            if count > 1:
                raise model.error(f"more than one coordinate is called '{name}'")
        self.wraps: dict[str, list[tuple[Element, Place]]] = {}
        for path, owner in self._frames.owners.items():
            for surface in owner.items("WrapObjectSet"):
                self.wraps.setdefault(surface.name, []).append((surface, self._place(path)))

    @property
    def angles(self) -> set[str]:
        """Names of the coordinates that are angles."""
        return {each.name for each in self.coordinates if each.rotates}

    def owners(self) -> list[tuple[Element, Place]]:
        """The elements of ground, bodies and frames on them, and where they are."""
        return [(owner, self._place(path)) for path, owner in self._frames.owners.items()]

    def add_frames(self, path: str, frames: list[Element]) -> None:
        """Add the frames that a component has of its own."""
        self._frames.add(path, frames)

    def place(self, element: Element, owner: str = "/") -> Place:
        """Where the frame is that an element of the component `owner` names."""
        return self._place(self._frames.path(element, owner))

    def body_of(self, element: Element, owner: str) -> Place:
        """Where the body of the frame is that an element of the component `owner` names."""
        return self.places[self._frames.on_body(self._frames.path(element, owner))[0]]

    def _place(self, path: str) -> Place:
        body, offset = self._frames.on_body(path)
        link, H = self.places[body]
        return Place(link, H @ offset)

    def _end(self, joint: Element) -> End:
        """Where a joint is."""
        body = joint.parent and joint.parent.parent
        if body is not None and body.tag == "Body":  # before version 4
            before = pose(joint, "orientation_in_parent", "location_in_parent")
            behind = pose(joint, "orientation", "location")
            parent = self._frames.path(joint.get("parent_body"), "/")
            end = End(joint, parent, before, body_path(body.name), behind)
            if not joint.flag("reverse"):
                return end
            # Its frames are exchanged, and what OpenSim takes for the parent is the child now.
            return End(joint, end.child, behind, end.parent, before)
        own = joint_path(joint)
        parent, before = self._frames.on_body(
            self._frames.path(joint.get("socket_parent_frame"), own)
        )
        child, behind = self._frames.on_body(
            self._frames.path(joint.get("socket_child_frame"), own)
        )
        return End(joint, parent, before, child, behind)

    def _join(self, ends: list[End]) -> None:
        """Place the bodies, from ground outwards; joints that point inwards are turned round."""
        at: dict[str, list[tuple[int, End]]] = {}
        for number, end in enumerate(ends):
            at.setdefault(end.parent, []).append((number, end))
            at.setdefault(end.child, []).append((number, end.reversed))
        passed: set[int] = set()
        reached = [GROUND_PATH]
        while reached:
            ends_here = chain.from_iterable(at.pop(body, ()) for body in reached)
            ready = {number: end for number, end in ends_here if number not in passed}
            for number in sorted(ready):
                self._join_one(ready[number])
            passed |= ready.keys()
            reached = [ready[number].child for number in sorted(ready)]
        for number, end in enumerate(ends):
            if number not in passed:
                raise end.joint.error("no chain of joints leads from ground to its parent")

    def _join_one(self, end: End) -> None:
        """Place the body behind a joint whose other body has been placed."""
        if end.child in self.places:
            raise end.joint.error("the body behind it has been reached by another joint")
        link, H = self.places[end.parent]
        coordinates, axes = read_axes(end.joint)
        if end.is_reversed:
            axes = [axis.backwards for axis in reversed(axes)]
        self.coordinates += coordinates
        first = len(self.links)
        link, H = self._move(link, H @ end.before, axes, coordinates)
        self.places[end.child] = Place(link, H @ np.linalg.inv(end.behind))
        moving = {each.coordinate.name for each in self.links[first:]}
        for coordinate in coordinates:
            if not coordinate.locked and coordinate.name not in moving:
                raise end.joint.error(f"coordinate '{coordinate.name}' moves nothing")

    def _move(
        self, link: int, H: np.ndarray, axes: list[Axis], coordinates: list[Coordinate]
    ) -> Place:
        """The frame behind a joint whose axes begin at the frame `H` of a link; adds its links."""
        leading: dict[str, Axis] = {}
        for axis in sorted(axes, key=lambda axis: axis.rotates):  # no angle if it also moves
            if axis.coordinate is not None and axis.is_own:
                leading.setdefault(axis.coordinate.name, axis)
        needed = {name for axis in axes if axis.fixed is None for name in axis.followed}
        self.links += [
            _slider(each) for each in coordinates if each.name in needed - leading.keys()
        ]
        for axis in axes:
            if axis.fixed is not None or axis.coordinate is None:
                H = H @ moved(axis, axis.fixed or 0.0)
                continue
            name, follows, direction = axis.coordinate.name, None, axis.direction
            if leading.get(name) is axis and isinstance(axis.function, Line):
                direction = axis.function.slope * direction
                H = H @ moved(axis, axis.function.value)
            else:
                name, of = axis.follower, axis.followed
                follows = DependentCoordinate(name, of=of, function=as_curve(axis.function))
            number, turn = aligned(direction)
            joint = number if axis.rotates else number + PRISMATIC
            nothing = Inertia(0.0, np.zeros(3), np.zeros((3, 3)))
            if not axis.carries:
                self.links.append(_slider(axis.coordinate)._replace(name=name, follows=follows))
                continue
            self.links.append(Link(joint, link, H @ turn, name, axis.coordinate, follows, nothing))
            link, H = len(self.links) - 1, turn.T
        return Place(link, H)

    def _couple(self, couplers: dict[str, Coupler]) -> None:
        """Let coordinates follow others."""
        numbers = {link.name: number for number, link in enumerate(self.links)}
        known = {coordinate.name for coordinate in self.coordinates}
        free = [link.name for link in self.links if not (link.follows or link.name in couplers)]
        for name, (of, given, element) in couplers.items():
            for each in (name, *of):
                if each not in known:
                    raise element.error(f"there is no coordinate '{each}'")
            if name in self.locked:
                raise element.error(f"coordinate '{name}' is locked as well")
            function = as_curve(given)
            if isinstance(function, SumOfProducts):
                function, of = without_locked(function, of, self.locked)
                value = None if of else function(())
            else:
                value = float(function(self.locked[of[0]])) if of[0] in self.locked else None
            if value is not None:  # as what follows: any other one, with slope zero
                if not free:
                    raise element.error("no coordinate is left that is independent")
                function, of = linear_function(0.0, value), (free[0],)
            with element.blamed():
                follows = DependentCoordinate(name, of=of, function=function)
            number = numbers[name]
            self.links[number] = self.links[number]._replace(follows=follows)

    def _add_inertia(self, place: Place, body: Element) -> None:
        """Add a body's mass to its link; ground needs none."""
        products = [f"inertia_{xy}" for xy in ("xx", "yy", "zz", "xy", "xz", "yz")]
        body.allow("mass", "mass_center", "inertia", *products, "Joint", *PARTS)
        if place.link == GROUND:
            return
        mass, center = body.number("mass"), body.vector("mass_center", default=ZERO)
        if mass < 0.0:
            raise body.get("mass").error(f"{mass:g} kg is negative")
        if body.version >= ONE_INERTIA or body.find("inertia") is not None:
            I = body.vector("inertia", 6, np.zeros(6).tolist())
        else:
            I = np.array([body.number(*given) for given in zip(products, OLD_INERTIA, strict=True)])
        R = place.pose[:3, :3]
        tensor = R @ I[[0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(3, 3) @ R.T
        link = self.links[place.link]
        inertia = link.inertia.plus(mass, place.at(center), tensor)
        self.links[place.link] = link._replace(inertia=inertia)


def _slider(coordinate: Coordinate) -> Link:
    """A link without mass for a coordinate that is no axis's own value: OpenSim calls it coupled,
    and never has it in degrees."""
    nothing = Inertia(0.0, np.zeros(3), np.zeros((3, 3)))
    return Link(PRISMATIC, GROUND, np.eye(4), coordinate.name, coordinate, None, nothing)
