"""Forces that nobody controls: limits, springs, ligaments, bushings and contact of a file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import combinations
from typing import Any

import numpy as np

from ..forces.passive.along_paths import (
    BlankevoortLigament,
    Ligament,
    PathSpring,
    PointToPointFormula,
    PointToPointSpring,
)
from ..forces.passive.between_frames import Bushing
from ..forces.passive.contact import SphereContact
from ..forces.passive.on_coordinates import (
    CoordinateFormula,
    CoordinateLimitForce,
    CoordinateSpring,
)
from ..muscle.laws.spline_law import PASSIVE as PASSIVE_CURVE
from ..numerics.splines import simm_spline
from ..path.points import PathPoint
from ..skeleton.passive import PassiveForce
from .bodies import Bodies
from .element import ON, Element
from .frames import pose
from .functions import Line, as_curve, read_function
from .linkers import LINKED, linked_frames
from .paths import path_tags, read_path

ALWAYS = ("isDisabled", *ON)
FORMULAS = tuple(f"{what}{axis}_expression" for what in "MF" for axis in "xyz")
FUNCTIONS = (
    *(f"m_{axis}_theta_{axis}_function" for axis in "xyz"),
    *(f"f_{axis}_delta_{axis}_function" for axis in "xyz"),
)
SEEN = ("moment_visual_scale", "force_visual_scale", "visual_aspect_ratio")
# Properties of `SmoothSphereHalfSpaceForce`, and what they are where a file does not say it.
SMOOTH_CONTACT = {
    "stiffness": 1.0, "dissipation": 0.0, "static_friction": 0.0, "dynamic_friction": 0.0,
    "viscous_friction": 0.0, "transition_velocity": 0.01, "constant_contact_force": 1e-5,
    "hertz_smoothing": 300.0, "hunt_crossley_smoothing": 50.0,
}  # fmt: skip
MATERIAL = (
    "stiffness", "dissipation", "static_friction", "dynamic_friction", "viscous_friction"
)  # fmt: skip


def read_passive_force(
    element: Element, bodies: Bodies, surfaces: Mapping[str, Element]
) -> list[PassiveForce]:
    """What a force of a file is here; nothing where it acts on what cannot move.

    `surfaces` are the model's contact geometries by their names.
    """
    with element.blamed():
        return PASSIVE[element.tag](element, bodies, surfaces)


def _limit(element: Element, bodies: Bodies, _: object) -> list[PassiveForce]:
    sides = [f"{side}_{what}" for side in ("upper", "lower") for what in ("limit", "stiffness")]
    other = ("damping", "transition", "compute_dissipation_energy")
    element.allow(*ALWAYS, "coordinate", *sides, *other)
    name = _coordinate(element, bodies)
    # Degrees at the file's edge, and forces for them.
    angle = np.pi / 180.0 if name in bodies.angles else 1.0
    given = {side: element.number(side, float("stiffness" in side)) for side in sides}
    if name in bodies.locked:
        return []
    return [
        CoordinateLimitForce(
            element.name,
            name,
            transition=angle * element.number("transition", 0.1),
            damping=element.number("damping", 0.001) / angle,
            **{
                side: value / angle if "stiffness" in side else value * angle
                for side, value in given.items()
            },
        )
    ]


def _spring(element: Element, bodies: Bodies, _: object) -> list[PassiveForce]:
    element.allow(*ALWAYS, "coordinate", "stiffness", "rest_length", "viscosity")
    name = _coordinate(element, bodies)
    if name in bodies.locked:
        return []
    return [
        CoordinateSpring(
            element.name,
            name,
            stiffness=element.number("stiffness", 0.0),
            rest=element.number("rest_length", 0.0),
            viscosity=element.number("viscosity", 0.0),
        )
    ]


def _formula(element: Element, bodies: Bodies, _: object) -> list[PassiveForce]:
    element.allow(*ALWAYS, "coordinate", "expression")
    name = _coordinate(element, bodies)
    formula = element.word("expression", default="0")
    return [] if name in bodies.locked else [CoordinateFormula(element.name, name, formula)]


def _coordinate(element: Element, bodies: Bodies) -> str:
    """The coordinate that a force names."""
    name = element.word("coordinate").rsplit("/", 1)[-1]
    known = [coordinate.name for coordinate in bodies.coordinates]
    if name not in known:
        raise element.get("coordinate").error(
            f"there is no coordinate '{name}', those are {', '.join(known)}"
        )
    return name


def _path_spring(element: Element, bodies: Bodies, _: object) -> list[PassiveForce]:
    given = ("resting_length", "stiffness", "dissipation")
    element.allow(*ALWAYS, *path_tags(element), *given)
    path, wraps = read_path(element, bodies)
    numbers = {name: element.number(name) for name in given}
    return [PathSpring(element.name, path=path, wraps=wraps, **numbers)]


def _ligament(element: Element, bodies: Bodies, _: object) -> list[PassiveForce]:
    curve = "force_length_curve"
    named = [child.tag for child in element.children if child.name == curve]
    element.allow(*ALWAYS, *path_tags(element), "resting_length", "pcsa_force", curve, *named)
    path, wraps = read_path(element, bodies)
    if element.find(curve) is None and not named:
        force_length = simm_spline(*PASSIVE_CURVE)  # OpenSim's, too
    else:
        force_length = as_curve(read_function(element.object(curve)))
    return [
        Ligament(
            element.name,
            path=path,
            wraps=wraps,
            resting_length=element.number("resting_length"),
            pcsa_force=element.number("pcsa_force", 0.0),
            force_length=force_length,
        )
    ]


def _blankevoort(element: Element, bodies: Bodies, _: object) -> list[PassiveForce]:
    defaults = {"linear_stiffness": 1.0, "transition_strain": 0.06, "damping_coefficient": 0.003}
    element.allow(*ALWAYS, *path_tags(element), "slack_length", *defaults)
    path, wraps = read_path(element, bodies)
    numbers = {name: element.number(name, value) for name, value in defaults.items()}
    slack = element.number("slack_length")
    return [
        BlankevoortLigament(element.name, path=path, wraps=wraps, slack_length=slack, **numbers)
    ]


def _two_points(element: Element, bodies: Bodies, _: object) -> list[PassiveForce]:
    sockets = [(f"socket_body{k}", f"body{k}") for k in (1, 2)]
    is_formula = element.tag == "ExpressionBasedPointToPointForce"
    given = ("expression",) if is_formula else ("stiffness", "rest_length")
    element.allow(*ALWAYS, "point1", "point2", *given, *(tag for pair in sockets for tag in pair))
    path = []
    for number, socket in enumerate(sockets, 1):
        place = bodies.place(element.get(*socket))
        point = element.vector(f"point{number}", default=(0.0, 0.0, 0.0))
        path.append(PathPoint(place.at(point).tolist(), place.link))
    if is_formula:
        formula = element.word("expression", default="0")
        return [PointToPointFormula(element.name, path=path, formula=formula)]
    return [
        PointToPointSpring(
            element.name,
            path=path,
            rest_length=element.number("rest_length", 0.0),
            stiffness=element.number("stiffness", 1.0),
        )
    ]


def _bushing(element: Element, bodies: Bodies, _: object) -> list[PassiveForce]:
    nothing = (0.0, 0.0, 0.0)
    damping = ("rotational_damping", "translational_damping")
    stiffness = ("rotational_stiffness", "translational_stiffness")
    own = {
        "BushingForce": stiffness,
        "ExpressionBasedBushingForce": (*FORMULAS, *SEEN),
        "FunctionBasedBushingForce": (*FUNCTIONS, *SEEN),
    }[element.tag]
    element.allow(*ALWAYS, *LINKED, *damping, *own)
    places = linked_frames(element, bodies, "/forceset")
    K, formulas, curves = [0.0] * 6, [], []
    if own is stiffness:
        K = np.ravel([element.vector(name, default=nothing) for name in stiffness]).tolist()
    elif FORMULAS[0] in own:
        formulas = [element.word(name, default="0") for name in FORMULAS]
    else:
        given = [
            read_function(element.object(name)) if element.find(name) else Line(0.0, 0.0)
            for name in FUNCTIONS
        ]
        curves = [as_curve(each) for each in given]
    return [
        Bushing(
            element.name,
            links=(places[0].link, places[1].link),
            frames=(places[0].pose, places[1].pose),
            stiffness=K,
            damping=np.ravel([element.vector(name, default=nothing) for name in damping]).tolist(),
            formulas=formulas,
            curves=curves,
        )
    ]


def _smooth_contact(
    element: Element, bodies: Bodies, surfaces: Mapping[str, Element]
) -> list[PassiveForce]:
    shown = ("force_visualization_radius", "force_visualization_scale_factor")
    element.allow(*ALWAYS, *SMOOTH_CONTACT, *shown, "socket_sphere", "socket_half_space")
    given = {name: element.number(name, value) for name, value in SMOOTH_CONTACT.items()}
    sphere, half_space = (
        _surface(element.get(tag), surfaces) for tag in ("socket_sphere", "socket_half_space")
    )
    k = 0.5 * given.pop("stiffness") ** (2.0 / 3.0)  # both are as stiff as one another
    return [_contact(element, bodies, sphere, half_space, stiffness=k, smooth=True, **given)]


def _hunt_crossley(
    element: Element, bodies: Bodies, surfaces: Mapping[str, Element]
) -> list[PassiveForce]:
    sets = "HuntCrossleyForce::ContactParametersSet"
    element.allow(*ALWAYS, sets, "contact_parameters", "transition_velocity")
    one = element.find(sets, "contact_parameters")
    found = []
    for material in [] if one is None else one.members():
        material.allow("geometry", *MATERIAL)
        numbers = {name: material.number(name, 0.0) for name in MATERIAL}
        for name in material.word("geometry", default="").split():
            found.append((_surface(material.get("geometry"), surfaces, name), numbers))
    speed = element.number("transition_velocity", 0.01)
    contacts: list[PassiveForce] = []
    for pair in combinations(found, 2):
        tags = [surface.tag for surface, _ in pair]
        if tags == ["ContactHalfSpace"] * 2:
            continue
        if _same_link(bodies, pair[0][0], pair[1][0]):
            continue  # they never move against one another
        (sphere, own), (half_space, other) = sorted(pair, key=lambda each: each[0].tag)[::-1]
        k, k_other = (each["stiffness"] ** (2.0 / 3.0) for each in (own, other))
        if k + k_other == 0.0:
            continue
        share = k_other / (k + k_other)
        mean = {name: _harmonic(own[name], other[name]) for name in MATERIAL[2:]}
        c = own["dissipation"] * share + other["dissipation"] * (1.0 - share)
        contacts.append(
            _contact(
                element,
                bodies,
                sphere,
                half_space,
                stiffness=k * share,
                dissipation=c,
                transition_velocity=speed,
                share=share,
                **mean,
            )
        )
    return contacts


def _contact(
    element: Element, bodies: Bodies, sphere: Element, half_space: Element, **given: Any
) -> SphereContact:
    surfaces = sphere, half_space
    place, ground = (bodies.place(each.get("socket_frame", "body_name")) for each in surfaces)
    other = half_space.number("radius") if half_space.tag == "ContactSphere" else 0.0
    center = sphere.vector("location", default=(0.0, 0.0, 0.0))
    return SphereContact(
        element.name,
        sphere=place.link,
        half_space=ground.link,
        center=place.at(center).tolist(),
        radius=sphere.number("radius"),
        frame=ground.pose @ pose(half_space, "orientation", "location"),
        other_radius=other,
        **given,
    )


def _surface(named: Element, surfaces: Mapping[str, Element], name: str = "") -> Element:
    """The sphere or half-space that an element names."""
    name = (name or named.text).rsplit("/", 1)[-1]
    if name not in surfaces:
        raise named.error(f"there is no contact geometry '{name}'")
    if surfaces[name].tag not in ("ContactSphere", "ContactHalfSpace"):
        surfaces[name].refuse()
    return surfaces[name]


def _same_link(bodies: Bodies, *surfaces: Element) -> bool:
    return len({bodies.place(each.get("socket_frame", "body_name")).link for each in surfaces}) == 1


def _harmonic(one: float, other: float) -> float:
    return 2.0 * one * other / (one + other) if one + other else 0.0


Reader = Callable[[Element, Bodies, Mapping[str, Element]], list[PassiveForce]]
PASSIVE: Mapping[str, Reader] = {
    "CoordinateLimitForce": _limit,
    "SpringGeneralizedForce": _spring,
    "ExpressionBasedCoordinateForce": _formula,
    "PathSpring": _path_spring,
    "Ligament": _ligament,
    "Blankevoort1991Ligament": _blankevoort,
    "PointToPointSpring": _two_points,
    "ExpressionBasedPointToPointForce": _two_points,
    "BushingForce": _bushing,
    "ExpressionBasedBushingForce": _bushing,
    "FunctionBasedBushingForce": _bushing,
    "SmoothSphereHalfSpaceForce": _smooth_contact,
    "HuntCrossleyForce": _hunt_crossley,
}
