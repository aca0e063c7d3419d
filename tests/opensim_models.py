"""The OpenSim models of the reference tables: their muscles, and sliding blocks as Exudyn systems.

Read from the .osim files in place, in their three versions. It reads what these files hold and is
no importer: a property that a file leaves out has the default of its OpenSim class.
"""

import dataclasses
import xml.etree.ElementTree as ElementTree

import exudyn as exu
import numpy as np
from exudyn.utilities import RigidBodyInertia, TreeLink
from scipy.spatial.transform import Rotation

import exudyn_muscles as em

from .opensim import REFERENCE

THELEN, MILLARD, DE_GROOTE_FREGLY = (
    "Thelen2003Muscle", "Millard2012EquilibriumMuscle", "DeGrooteFregly2016Muscle"
)  # fmt: skip
FILES = {
    "tug_of_war": "Tug_of_War.osim",
    "tug_of_war_millard": "Tug_of_War_Millard.osim",
    "twoMusclesOnBlock": "twoMusclesOnBlock.osim",
    "block_hanging_from_muscle": "block_hanging_from_muscle.osim",
    "arm26": "arm26.osim",
    "arm26_millard": "arm26.osim",
    "leg6dof9musc": "leg6dof9musc.osim",
}
TIME_CONSTANTS = {THELEN: (0.015, 0.050), MILLARD: (0.010, 0.040), DE_GROOTE_FREGLY: (0.015, 0.060)}
UNIT = (
    "max_isometric_force", "optimal_fiber_length", "tendon_slack_length",
    "pennation_angle_at_optimal", "max_contraction_velocity", "minimum_activation",
    "activation_time_constant", "deactivation_time_constant", "activation_dynamics_smoothing",
    "tendon_strain_at_one_norm_force", "ignore_tendon_compliance",
)  # fmt: skip
# Thelen's names here.
NAMES = {
    "FmaxTendonStrain": "tendon_strain_at_one_norm_force",
    "FmaxMuscleStrain": "fmax_muscle_strain",
    "KshapeActive": "kshape_active",
    "KshapePassive": "kshape_passive",
    "Af": "af",
    "Flen": "flen",
}
ACTIVE = (
    "min_norm_active_fiber_length", "transition_norm_fiber_length", "max_norm_active_fiber_length",
    "shallow_ascending_slope", "minimum_value",
)  # fmt: skip
VELOCITY = (
    "concentric_slope_at_vmax", "concentric_slope_near_vmax", "isometric_slope",
    "eccentric_slope_at_vmax", "eccentric_slope_near_vmax",
    "max_eccentric_velocity_force_multiplier",
)  # fmt: skip
STRAINS = ("strain_at_zero_force", "strain_at_one_norm_force")


def elements(name):
    """The model's file and its muscles."""
    root = ElementTree.parse(REFERENCE.parent / "models" / FILES[name]).getroot()
    found = [item for item in root.iter() if item.tag in (THELEN, MILLARD)]
    if name == "arm26_millard":  # made by replacing the class's name
        for item in found:
            item.tag = MILLARD
    return root, found


def numbers(element, names):
    """The numbers among an element's properties."""
    if element is None:
        return {}
    texts = {name: element.findtext(name, "").strip() for name in names}
    return {name: float(text) for name, text in texts.items() if text}


def vector(text):
    return np.array([float(number) for number in text.split()])


def muscle(kind, name, properties, path=()):
    """A muscle of an OpenSim class from the properties that differ from the class's defaults."""
    given = {NAMES.get(key, key): value for key, value in properties.items()}
    unit = {key: given.pop(key) for key in UNIT if key in given}
    rise, fall = TIME_CONSTANTS[kind]
    activation = em.ActivationDynamics.FIRST_ORDER
    if kind == DE_GROOTE_FREGLY:
        activation = em.ActivationDynamics.SMOOTH
    law = {
        THELEN: em.Thelen2003,
        MILLARD: em.Millard2012,
        DE_GROOTE_FREGLY: em.DeGrooteFregly2016,
    }[kind]
    defaults = {"activation_time_constant": rise, "deactivation_time_constant": fall}
    return em.Muscle(
        name, **defaults | unit, activation_dynamics=activation, law=law(**given), path=path
    )


def read_muscle(element, path=()):
    """A muscle of a file."""
    given = numbers(element, UNIT[:8])
    if element.tag == THELEN:
        given |= numbers(element, NAMES)
    else:
        given |= numbers(element, ["fiber_damping"])
        given |= numbers(element.find("ActiveForceLengthCurve"), ACTIVE)
        given |= numbers(element.find("ForceVelocityCurve"), VELOCITY)
        for part in ("Fiber", "Tendon"):
            found = numbers(element.find(f"{part}ForceLengthCurve"), STRAINS)
            given |= {f"{part.lower()}_{key}": value for key, value in found.items()}
    return muscle(element.tag, element.get("name"), given, path)


def muscles(name):
    """A model's muscles without their paths, in the file's order."""
    return em.MuscleSet(read_muscle(element) for element in elements(name)[1])


def block(name, **changes):
    """A block on a slider, its muscles along straight lines, as an Exudyn system.

    The tree's one link has the axes of the joint's frame on the block. `changes` replace the
    muscles' own parameters.
    """
    root, found = elements(name)
    body = next(item for item in root.iter("Body") if item.get("name") == "block")
    joint = next(root.iter("SliderJoint"))
    if joint.find("frames") is None:
        names = ("location_in_parent", "orientation_in_parent", "location", "orientation")
        numbers_of = [vector(joint.findtext(name)) for name in names]
    else:
        names = ("translation", "orientation")
        numbers_of = [
            vector(frame.findtext(name)) for frame in joint.find("frames") for name in names
        ]
    origin, angles, child_origin, child_angles = numbers_of
    axes, child_axes = (
        Rotation.from_euler("XYZ", each).as_matrix() for each in (angles, child_angles)
    )
    joint_frame = np.eye(4)
    joint_frame[:3, :3], joint_frame[:3, 3] = axes, origin

    def on_link(position):
        return child_axes.T @ (position - child_origin)

    def point(element):
        owner = element.findtext("socket_parent_frame") or element.findtext("body")
        position = vector(element.findtext("location"))
        if owner.strip().endswith("ground"):
            return em.PathPoint(position)
        return em.PathPoint(on_link(position), link=0)

    SC = exu.SystemContainer()
    mbs = SC.AddSystem()
    link = TreeLink(
        jointType=exu.JointType.PrismaticX,
        parent=-1,
        jointHT=joint_frame,
        linkInertia=RigidBodyInertia(
            mass=float(body.findtext("mass")),
            inertiaTensor=np.eye(3),  # a slider does not turn
            com=on_link(vector(body.findtext("mass_center"))),
        ),
    )
    tree = mbs.CreateKinematicTree(
        listOfTreeLinks=[link], gravity=vector(next(root.iter("gravity")).text)
    )
    mbs.Assemble()
    units = [
        dataclasses.replace(read_muscle(item, map(point, item.iter("PathPoint"))), **changes)
        for item in found
    ]
    coordinate = next(joint.iter("Coordinate")).get("name")
    return em.MusculoskeletalModel(mbs, tree, units, coordinates=[coordinate])
