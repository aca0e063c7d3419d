"""Numbers of OpenSim 4.6 for the analyses, from its wheel: joint reactions as JointReaction has
them, the columns of MuscleAnalysis, and the metabolic probes:

    python -m tests.make_analyses     # with `pip install opensim`

writes `tests/reference/opensim/analyses_<model>.npz`, and `joint_loads.npz` of models with loops
and passive forces. Models are one of this project's own, and of
OpenSim's pipelines those beside this repository. States are drawn around the default pose, with
fibres near to equilibrium; muscles have the forces that follow in the muscles' columns, others in
the joint reactions, as from a file of forces, once without those that may wrap. SI units, radians,
everything in ground.
"""

import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from exudyn_muscles.files.disk import write_arrays

from .opensim import REFERENCE, loop_models, passive_models
from .own_models import FOLDER, OWN

STATES = 4
ROWS = 3  # of the models of loops and passive forces
SEED = 20260815
PIPELINES = REFERENCE.parent / "cmc"
# Model, reserves and residuals, external loads, and where these have forces [s].
FILES = {
    "arm26": ("arm26/arm26.osim", "arm26/arm26_Reserve_Actuators.xml", None, (0.0, 1.0)),
    "leg6dof9musc": ("leg_swing/leg6dof9musc.osim", None, None, (0.0, 1.0)),
    "gait2354": (
        "gait2354/subject01_simbody_adjusted.osim",
        "gait2354/gait2354_CMC_Actuators.xml",
        "gait2354/subject01_walk1_grf.xml",
        (0.7, 1.5),
    ),
}
# Options of the probes that change the numbers, over OpenSim's own.
UMBERGER = {
    "umberger": {},
    "umberger_2003": {
        "use_Bhargava_recruitment_model": False, "forbid_negative_total_power": False
    },
    "umberger_2010": {
        "use_Bhargava_recruitment_model": False, "forbid_negative_total_power": False,
        "include_negative_mechanical_work": False,
    },
    "umberger_anaerobic": {
        "aerobic_factor": 1.0, "enforce_minimum_heat_rate_per_muscle": False,
        "basal_coefficient": 1.5, "basal_exponent": 0.8,
    },
}  # fmt: skip
BHARGAVA = {
    "bhargava": {},
    "bhargava_force": {"use_force_dependent_shortening_prop_constant": True},
    "bhargava_open": {
        "forbid_negative_total_power": False, "enforce_minimum_heat_rate_per_muscle": False,
        "include_negative_mechanical_work": False,
    },
}  # fmt: skip
HEAT = 40.0, 133.0, 74.0, 111.0  # W/kg, of the first paper's table
MUSCLE = {
    "length": "getLength", "lengthening_speed": "getLengtheningSpeed",
    "fiber_length": "getFiberLength", "normalized_fiber_length": "getNormalizedFiberLength",
    "fiber_velocity": "getFiberVelocity",
    "normalized_fiber_velocity": "getNormalizedFiberVelocity",
    "pennation_angle": "getPennationAngle", "tendon_length": "getTendonLength",
    "tendon_force": "getTendonForce", "active_fiber_force": "getActiveFiberForce",
    "passive_fiber_force": "getPassiveFiberForce",
    "active_fiber_force_along_tendon": "getActiveFiberForceAlongTendon",
    "passive_fiber_force_along_tendon": "getPassiveFiberForceAlongTendon",
    "fiber_active_power": "getFiberActivePower", "fiber_passive_power": "getFiberPassivePower",
    "tendon_power": "getTendonPower", "muscle_power": "getMusclePower",
}  # fmt: skip


def loaded(opensim, name, folder):
    """The model with everything that acts on it, and the span of its external forces."""
    if name in OWN:
        (folder / f"{name}.osim").write_text(OWN[name]())
        return opensim.Model(str(folder / f"{name}.osim")), (0.0, 1.0)
    file, actuators, loads, span = FILES[name]
    os.chdir((PIPELINES / file).parent)
    model = opensim.Model(str(PIPELINES / file))
    if actuators is not None:
        forces = opensim.ForceSet(str(PIPELINES / actuators))
        for k in range(forces.getSize()):
            model.addForce(forces.get(k).clone())
    if loads is not None:
        model.addModelComponent(opensim.ExternalLoads(str(PIPELINES / loads), True))
    return model, span


def add_probes(opensim, model):
    """Probes of every kind with all muscles, by their names, with ratios of slow-twitch fibres."""
    muscles = model.getMuscles()
    names = [muscles.get(k).getName() for k in range(muscles.getSize())]
    ratios = 0.3 + 0.5 * np.linspace(0.0, 1.0, len(names))
    made = {}
    for options, kind in (
        (UMBERGER, opensim.Umberger2010MuscleMetabolicsProbe),
        (BHARGAVA, opensim.Bhargava2004MuscleMetabolicsProbe),
    ):
        for name, values in options.items():
            probe = kind()
            probe.setName(name)
            probe.set_report_total_metabolics_only(False)
            for option, value in values.items():
                getattr(probe, f"set_{option}")(value)
            for muscle, ratio in zip(names, ratios, strict=True):
                heat = HEAT if options is BHARGAVA else ()
                probe.addMuscle(muscle, float(ratio), *heat)
            model.addProbe(probe)
            made[name] = probe
    return made, ratios


def vector(values):
    return np.array([values.get(k) for k in range(values.size())])


def spatial(reaction):
    """Force and torque (6,) of a spatial vector, which has them the other way round."""
    return np.concatenate([vector(reaction.get(1)), vector(reaction.get(0))])


def follow(model, state, coupled):
    """Give coordinates that follow others their speeds, which OpenSim leaves where they are."""

    def lacking(speeds):
        for each, speed in zip(coupled, speeds, strict=True):
            each.setSpeedValue(state, float(speed))
        model.realizeVelocity(state)
        return vector(state.getUErr())

    if coupled:
        rest = lacking(np.zeros(len(coupled)))
        slopes = np.array([lacking(row) - rest for row in np.eye(len(coupled))])
        lacking(np.linalg.lstsq(slopes.T, -rest, rcond=None)[0])


def under(opensim, model, state, forces):
    """The state with these forces of all actuators, as accelerations follow from them."""
    given, actuators = opensim.State(state), model.getActuators()
    for k, force in enumerate(forces):
        actuator = opensim.ScalarActuator.safeDownCast(actuators.get(k))
        actuator.overrideActuation(given, True)
        actuator.setOverrideActuation(given, float(force))
    model.realizeAcceleration(given)
    return given


def reactions(model, state, side="Child"):
    """Force and torque (6,) in every joint, on the child or the parent."""
    joints = [model.getJointSet().get(k) for k in range(model.getNumJoints())]
    return [spatial(getattr(j, f"calcReactionOn{side}ExpressedInGround")(state)) for j in joints]


def joint_loads(folder):
    """Reactions on children (rows, joints, 6) of the models of loops and of passive forces, at
    the first states of theirs that `make_opensim` has stored."""
    import opensim

    opensim.Logger.setLevelString("error")
    found = {}
    for room, models in (("loops", loop_models.CONSTRAINTS), ("passive", passive_models.FORCES)):
        stored, source = np.load(FOLDER / f"{room}.npz"), (loop_models, passive_models)
        for name in models:
            loops = room == "loops"
            file = folder / f"{room}_{name}.osim"
            file.write_text(source[not loops].model(name))
            model = opensim.Model(str(file))
            state, set_ = model.initSystem(), model.getCoordinateSet()
            names = list(loop_models.DEFAULTS) if loops else stored["names"].tolist()
            q, u = (stored[f"{name}_{key}" if loops else key][:ROWS] for key in "qu")
            forces = stored[f"{name}_F"][:ROWS] if loops else np.zeros((ROWS, 0))
            actuators = model.getActuators().getSize()
            rows = []
            for place, speed, F in zip(q, u, forces, strict=True):
                for each, value, rate in zip(names, place, speed, strict=True):
                    set_.get(each).setValue(state, float(value), False)
                    set_.get(each).setSpeedValue(state, float(rate))
                F = F if loops else np.full(actuators, 50.0)
                rows.append(reactions(model, under(opensim, model, state, F)))
            found[f"{room}_{name}"] = np.array(rows)
    return found


def numbers(name, folder):
    """All arrays of a model."""
    import opensim

    opensim.Logger.setLevelString("error")
    model, span = loaded(opensim, name, folder)
    probes, ratios = add_probes(opensim, model)
    model.set_assembly_accuracy(1e-13)
    state = model.initSystem()
    draw = np.random.default_rng(SEED)
    coordinates = [model.getCoordinateSet().get(k) for k in range(model.getNumCoordinates())]
    free = [each for each in coordinates if not each.isConstrained(state)]
    muscles = [model.getMuscles().get(k) for k in range(model.getMuscles().getSize())]
    actuators = [model.getActuators().get(k) for k in range(model.getActuators().getSize())]
    wrapping = np.array([m.getGeometryPath().getWrapSet().getSize() > 0 for m in muscles])
    joints = [model.getJointSet().get(k) for k in range(model.getNumJoints())]
    rows = []
    for t in np.linspace(*span, STATES):
        state.setTime(float(t))
        q, v = draw.uniform(-0.15, 0.15, len(free)), draw.uniform(-1.0, 1.0, len(free))
        for each, dq, speed in zip(free, q, v, strict=True):
            each.setValue(state, each.getDefaultValue() + dq, False)
            each.setSpeedValue(state, speed)
        model.assemble(state)
        follow(model, state, [each for each in coordinates if each.isConstrained(state)])
        excitation = draw.uniform(0.02, 0.9, len(muscles))
        for muscle in muscles:
            muscle.setActivation(state, draw.uniform(0.05, 0.8))
        model.equilibrateMuscles(state)
        for muscle in muscles:
            stretch = 1.0 + draw.uniform(-2e-3, 2e-3)
            muscle = opensim.ActivationFiberLengthMuscle.safeDownCast(muscle)
            if muscle is not None and not muscle.get_ignore_tendon_compliance():
                muscle.setFiberLength(state, stretch * muscle.getFiberLength(state))
        model.realizeVelocity(state)
        controls = opensim.Vector(model.getNumControls(), 0.0)
        for muscle, u in zip(muscles, excitation, strict=True):
            muscle.setControls(opensim.Vector(1, float(u)), controls)
        model.setControls(state, controls)
        model.realizeDynamics(state)
        row = {
            "time": t,
            "coordinates": [each.getValue(state) for each in free],
            "speeds": [each.getSpeedValue(state) for each in free],
            "activations": [muscle.getActivation(state) for muscle in muscles],
            "excitations": excitation,
        }
        for column, getter in MUSCLE.items():
            row[column] = [getattr(muscle, getter)(state) for muscle in muscles]
        row["moment_arms"] = [
            [muscle.computeMomentArm(state, each) for each in free] for muscle in muscles
        ]
        model.realizeReport(state)
        for probe, made in probes.items():
            row[probe] = vector(made.computeProbeInputs(state))
        row["forces"] = draw.uniform(0.0, 500.0, len(actuators))
        row["forces"][len(muscles) :] = draw.uniform(-50.0, 50.0, len(actuators) - len(muscles))
        straight = row["forces"] * np.append(~wrapping, np.ones(len(actuators) - len(muscles)))
        for kind, forces in (("", straight), ("_wrapping", row["forces"])):
            given = under(opensim, model, state, forces)
            for side in ("Child", "Parent"):
                row[f"on_{side.lower()}{kind}"] = reactions(model, given, side)
        row["centers"] = [vector(j.getChildFrame().getPositionInGround(given)) for j in joints]
        rows.append(row)
    arrays = {key: np.array([row[key] for row in rows]) for key in rows[0]}
    return arrays | {
        "coordinate_names": np.array([each.getName() for each in free]),
        "muscle_names": np.array([each.getName() for each in muscles]),
        "actuator_names": np.array([each.getName() for each in actuators]),
        "joint_names": np.array([each.getName() for each in joints]),
        "joint_coordinates": np.array(
            [" ".join(j.get_coordinates(k).getName() for k in range(j.numCoordinates()))
             for j in joints]
        ),
        "slow_twitch_ratios": ratios,
        "wrapping": wrapping,
        "mass": np.array(model.getTotalMass(state)),
    }  # fmt: skip


def main(names):
    with TemporaryDirectory() as folder:
        write_arrays(FOLDER / "joint_loads.npz", **joint_loads(Path(folder)))
        for name in names or ("arm", *FILES):
            file = FOLDER / f"analyses_{name}.npz"
            write_arrays(file, **numbers(name, Path(folder)))
            print(f"{file.name}: {file.stat().st_size} bytes")


if __name__ == "__main__":
    main(sys.argv[1:])
