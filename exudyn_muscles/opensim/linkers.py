"""Components that link two frames, each with frames of its own or by their place on bodies."""

from __future__ import annotations

from .bodies import Bodies
from .element import Element
from .frames import Place, pose

OLD_FRAMES = tuple(f"{what}body_{k}" for k in (1, 2) for what in ("", "location_", "orientation_"))
LINKED = ("frames", "socket_frame1", "socket_frame2", *OLD_FRAMES)


def linked_frames(element: Element, bodies: Bodies, owner: str) -> list[Place]:
    """Both frames of a component of a set; before version 4 they are given on bodies."""
    if element.find("body_1") is not None:
        places = []
        for k in (1, 2):
            body = bodies.place(element.get(f"body_{k}"))
            on_body = pose(element, f"orientation_body_{k}", f"location_body_{k}")
            places.append(Place(body.link, body.pose @ on_body))
        return places
    path = f"{owner}/{element.name}"
    bodies.add_frames(path, element.items("frames"))
    return [bodies.place(element.get(f"socket_frame{k}"), path) for k in (1, 2)]
