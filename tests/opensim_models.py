"""The models of the reference tables, OpenSim's in place: as the importer builds them, and their
muscles read apart from it, whatever joints the file has.
"""

import dataclasses
import xml.etree.ElementTree as ElementTree
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import exudyn_muscles as em

from .opensim import REFERENCE
from .own_models import OWN

_written = TemporaryDirectory()  # models of our own, for the time of the tests

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


@cache
def path_of(name):
    """A model's file."""
    if name not in OWN:
        return REFERENCE.parent / "models" / FILES[name]
    file = Path(_written.name) / f"{name}.osim"
    file.write_text(OWN[name]())
    return file


def elements(name):
    """The model's file and its muscles."""
    root = ElementTree.parse(path_of(name)).getroot()
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


def load(name, **changes):
    """A model as the importer builds it; `changes` replace the muscles' own parameters."""
    model = em.opensim.load_model(path_of(name))
    if not changes:
        return model
    return rebuilt(model, [dataclasses.replace(muscle, **changes) for muscle in model.muscles])


def rebuilt(model, muscles, reserves=()):
    """A loaded model with other muscles and reserves."""
    skeleton = model.skeleton
    return em.MusculoskeletalModel(
        model.mbs, skeleton.object, muscles, coordinates=skeleton.tree_coordinates,
        dependent_coordinates=model.dependent_coordinates, reserves=reserves, loops=model.loops,
    )  # fmt: skip
