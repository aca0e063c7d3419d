"""Frames by their paths: bodies, and frames at fixed places of them.

A `StationDefinedFrame` is given by points a, b, c and its origin: one of its axes is along a to b,
another one along ab x ac, and the third one along ab x (ab x ac).
"""

from __future__ import annotations

import posixpath

import numpy as np

from .components import FRAMES, STATIONS, refuse_active
from .element import Element
from .frames import ZERO, pose

PARTS = ("WrapObjectSet", "components")
GROUND_PATH = "/ground"
POINTS = ("point_a", "point_b", "point_c", "origin_point")


def body_path(name: str) -> str:
    """A body's path in OpenSim 4."""
    return GROUND_PATH if name == "ground" else f"/bodyset/{name}"


class FrameSet:
    """The frames of a model.

    Attributes
    ----------
    owners : dict of str to Element
        Bodies and frames by their paths, ground if the file has something on it.
    """

    def __init__(self, model: Element) -> None:
        self.owners: dict[str, Element] = {}
        self._offsets: dict[str, tuple[str, np.ndarray]] = {}
        self._given: dict[str, Element] = {}
        self._begun: set[str] = set()  # those whose offsets were asked for
        self._stations = {
            f"/markerset/{each.name}": each
            for each in model.items("MarkerSet")
            if each.tag in STATIONS
        }
        ground = model.find("Ground")
        if ground is not None:
            ground.allow(*PARTS)
            self._add_owner(GROUND_PATH, ground)
        for body in model.items("BodySet"):
            if body.tag != "Body":
                body.refuse()
            self._add_owner(body_path(body.name), body)
        for tag, path in (("components", ""), ("FrameSet", ""), ("ComponentSet", "/componentset")):
            known = (*FRAMES, *STATIONS)
            self.add(path, [each for each in model.items(tag) if each.tag in known])

    def add(self, path: str, components: list[Element]) -> None:
        """Add the frames, and the stations, that the component with this path has of its own."""
        refuse_active(components)
        for each in components:
            if each.tag in STATIONS:
                self._stations[f"{path}/{each.name}"] = each
        for frame in components:
            if frame.tag in FRAMES:
                own = f"{path}/{frame.name}"
                self._add_owner(own, frame)
                self._given[own] = frame

    def path(self, element: Element, owner: str) -> str:
        """The path of a frame named in an element of the component `owner`, or of a body's name."""
        path = posixpath.normpath(posixpath.join(owner, element.text))
        for candidate in (path, body_path(element.text)):
            if candidate in self.owners or candidate == GROUND_PATH:
                return candidate
        raise element.error(f"there is no frame '{element.text}'")

    def on_body(self, path: str) -> tuple[str, np.ndarray]:
        """The body that a frame is on, and the frame's pose on it."""
        passed: dict[str, None] = {}
        while path in self._offsets or path in self._given:
            new = path not in self._offsets
            if path in passed or (new and path in self._begun):
                raise self.owners[path].error("the frames are on one another, in a circle")
            passed[path] = None
            if new:
                self._begun.add(path)
                self._offsets[path] = self._offset(path, self._given[path])
            path, H = self._offsets[path]
        body, H = path, np.eye(4)
        for path in reversed(passed):  # each is on the body itself from now on
            H = H @ self._offsets[path][1]
            self._offsets[path] = body, H
        return body, H

    def check(self) -> None:
        """Raise ModelFileError unless all of them have a place."""
        for path in self.owners:
            self.on_body(path)

    def _add_owner(self, path: str, owner: Element) -> None:
        """Add a body or frame, with the frames among its components."""
        if path in self.owners:
            raise owner.error(f"there is another one, in line {self.owners[path].line}")
        self.owners[path] = owner
        self.add(path, owner.items("components"))

    def _offset(self, own: str, frame: Element) -> tuple[str, np.ndarray]:
        """What a frame is on, and its pose there."""
        if frame.tag == "StationDefinedFrame":
            return self._defined(own, frame)
        frame.allow("socket_parent", "translation", "orientation", *PARTS)
        parent = self.path(frame.get("socket_parent"), own)
        return parent, pose(frame, "orientation", "translation")

    def _defined(self, own: str, frame: Element) -> tuple[str, np.ndarray]:
        """The body and the pose on it of a frame that stations define."""
        frame.allow(*(f"socket_{point}" for point in POINTS), "ab_axis", "ab_x_ac_axis", *PARTS)
        found = [self._station(frame.get(f"socket_{point}"), own) for point in POINTS]
        if len({body for body, _ in found}) > 1:
            raise frame.error("its stations are on different bodies")
        a, b, c, origin = (at for _, at in found)
        ab, across = b - a, np.cross(b - a, c - a)
        if not np.linalg.norm(across) > 0.0:
            raise frame.error("its points a, b and c are on one line")
        axes = [_axis(frame, "ab_axis", "+x"), _axis(frame, "ab_x_ac_axis", "+y")]
        (first, sign), (second, other) = axes
        if first == second:
            raise frame.get("ab_x_ac_axis").error("it is the axis of ab_axis as well")
        H = np.eye(4)
        H[:3, first] = sign * ab / np.linalg.norm(ab)
        H[:3, second] = other * across / np.linalg.norm(across)
        third = 3 - first - second
        H[:3, third] = np.cross(H[:3, (third + 1) % 3], H[:3, (third + 2) % 3])
        H[:3, 3] = origin
        return found[0][0], H

    def _station(self, socket: Element, owner: str) -> tuple[str, np.ndarray]:
        """The body that a station is on, and its place there (3,)."""
        path = posixpath.normpath(posixpath.join(owner, socket.text))
        if path not in self._stations:
            raise socket.error(f"there is no station '{socket.text}'")
        station = self._stations[path]
        station.allow("socket_parent_frame", "location", "fixed")
        body, H = self.on_body(self.path(station.get("socket_parent_frame"), path))
        return body, H[:3, :3] @ station.vector("location", default=ZERO) + H[:3, 3]


def _axis(frame: Element, tag: str, default: str) -> tuple[int, float]:
    """The number and sign of an axis of a frame."""
    text = frame.word(tag, default=default).lower()
    if text.lstrip("+-") not in ("x", "y", "z") or len(text) > 2:
        raise frame.get(tag).error(f"expected an axis such as +x, got '{text}'")
    return "xyz".index(text[-1]), -1.0 if text[0] == "-" else 1.0
