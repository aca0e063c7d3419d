"""Numbers of OpenSim 4.6 for this project's own models and for its muscle classes, from its wheel:

    python -m tests.make_opensim     # with `pip install opensim`

writes `tests/reference/opensim`. Models are those of `own_models`; SI units and radians.
"""

import json
import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from exudyn_muscles.files.disk import write_arrays, write_file

from .opensim import cylinder_model, joint_models, loop_models, passive_models, torus_model
from .own_models import (
    FOLDER,
    MODEL,
    OWN,
    SETUP,
    STATIC,
    body,
    cmc_files,
    coordinate,
    joint,
    muscle,
    static_files,
)

STATES = 12
SEED = 20260601
# Of forward simulations [s]. The leg's ends before its knee lets a point come, which jumps.
SPANS, ROWS = {"blocks": 1.0, "arm": 1.0, "leg": 0.05}, 50
ACCURACY = 1e-10
# Of single units: what differs from their class's defaults.
KINDS = {
    "thelen": ("Thelen2003Muscle", {}),
    "thelen_other": (
        "Thelen2003Muscle",
        {
            "FmaxTendonStrain": 0.033, "FmaxMuscleStrain": 0.6, "KshapeActive": 0.5,
            "KshapePassive": 4.0, "Af": 0.3, "Flen": 1.8, "activation_time_constant": 0.01,
            "deactivation_time_constant": 0.04,
        },
    ),
    "millard": ("Millard2012EquilibriumMuscle", {}),
    "millard_b001": ("Millard2012EquilibriumMuscle", {"fiber_damping": 0.01}),
    "millard_undamped": ("Millard2012EquilibriumMuscle", {"fiber_damping": 0.0}),
    "millard_rigid": ("Millard2012EquilibriumMuscle", {"ignore_tendon_compliance": True}),
    "dgf": ("DeGrooteFregly2016Muscle", {"activation_dynamics_smoothing": 10.0}),
    "dgf_smooth01": ("DeGrooteFregly2016Muscle", {}),
    "dgf_rigid": (
        "DeGrooteFregly2016Muscle", {"ignore_tendon_compliance": True, "fiber_damping": 0.01}
    ),
}  # fmt: skip
# Those whose tendons are rigid whatever a file says.
RIGID_KINDS = {
    "meyer": ("MeyerFregly2016Muscle", {"ignore_tendon_compliance": True}),
    "meyer_wide": (
        "MeyerFregly2016Muscle",
        {
            "ignore_tendon_compliance": True, "active_force_width_scale": 1.4,
            "fiber_damping": 0.01, "ignore_passive_fiber_force": True,
        },
    ),
    "splines": ("RigidTendonMuscle", {}),
}  # fmt: skip
SINGLE = {"force": 1000.0, "fiber": 0.1, "tendon": 0.2, "pennation": 0.2}
LENGTH = 0.302  # of single units [m]
# Their excitation over time [s]: piecewise linear.
RAMPS = ([0.0, 0.05, 0.06, 0.30, 0.31, 0.6], [0.05, 0.05, 0.9, 0.9, 0.05, 0.05])
SINGLE_ROW = 0.01


def load(text):
    """A system in OpenSim, from the text of its file."""
    import opensim

    with TemporaryDirectory() as folder:
        file = Path(folder) / "model.osim"
        file.write_text(text)
        return opensim.Model(str(file))


def coordinates_of(model, state):
    """In the order of the mobilities."""
    found = model.getCoordinateSet()
    listed = [found.get(k) for k in range(found.getSize())]
    places = []
    for each in listed:
        for other in listed:
            other.setSpeedValue(state, float(other is each))
        places.append(int(vector(state.getU()).argmax()))
    for each in listed:
        each.setSpeedValue(state, 0.0)
    return [listed[k] for k in np.argsort(places)]


def muscles_of(model):
    found = model.getMuscles()
    return [found.get(k) for k in range(found.getSize())]


def bodies_of(model):
    found = model.getBodySet()
    return [found.get(k) for k in range(found.getSize())]


def vector(values):
    return np.array([values.get(k) for k in range(values.size())])


def accelerations(model, state):
    model.realizeAcceleration(state)
    return vector(state.getUDot())


def bias(model, state):
    """H - Q: the forces (n,) that hold the accelerations at zero."""
    import opensim

    still = opensim.Vector(state.getNU(), 0.0)
    return vector(opensim.InverseDynamicsSolver(model).solve(state, still))


def static(name):
    """Random states (STATES, ...): bodies, paths, muscles and accelerations."""
    import opensim

    text = OWN[name]()
    model, passive = load(text), load(text)
    passive.updForceSet().clearAndDestroy()
    state, passive_state = model.initSystem(), passive.initSystem()
    coordinates = coordinates_of(model, state)
    muscles, bodies = muscles_of(model), bodies_of(model)
    names = [each.getName() for each in coordinates]
    rng = np.random.default_rng(SEED)
    rows = []
    for number in range(STATES):
        for each in coordinates:
            low, high = each.getRangeMin(), each.getRangeMax()
            value = low + (high - low) * rng.uniform(0.05, 0.95)
            rotates = each.getMotionType() == opensim.Coordinate.Rotational
            speed = rng.uniform(-1.0, 1.0) * (5.0 if rotates else 1.0)
            if number == 0:
                value, speed = each.getDefaultValue(), 0.0
            each.setValue(state, value, False)
            each.setSpeedValue(state, speed)
        model.assemble(state)
        q, u = (
            np.array([at(each) for each in coordinates])
            for at in (lambda each: each.getValue(state), lambda each: each.getSpeedValue(state))
        )
        if "patella_angle" in names:  # the coupler is the identity
            u[names.index("patella_angle")] = u[names.index("knee_angle")]
            state.setU(opensim.Vector(u.tolist()))
        a, e = rng.uniform([0.05, 0.02], [0.95, 1.0], (len(muscles), 2)).T
        for each, activation in zip(muscles, a, strict=True):
            each.setActivation(state, activation)
        row = dict.fromkeys(("lf_eq", "Ft_eq"), None)
        at_rest = opensim.State(state)
        at_rest.setU(opensim.Vector(np.zeros(len(u)).tolist()))
        model.realizeVelocity(at_rest)
        for each in muscles:
            each.computeEquilibrium(at_rest)
        model.realizeDynamics(at_rest)
        row["lf_eq"] = [each.getFiberLength(at_rest) for each in muscles]
        row["Ft_eq"] = [each.getTendonForce(at_rest) for each in muscles]
        for each, fiber in zip(muscles, row["lf_eq"], strict=True):
            own = opensim.Thelen2003Muscle.safeDownCast(each)
            own = own or opensim.Millard2012EquilibriumMuscle.safeDownCast(each)
            nearby = fiber * rng.uniform(0.99, 1.01)
            own.setFiberLength(state, max(nearby, own.getMinimumFiberLength()))
        controls = opensim.Vector(e.tolist())
        model.realizeVelocity(state)
        model.setControls(state, controls)
        udot = accelerations(model, state)
        passive_state.setQ(state.getQ())
        passive_state.setU(state.getU())
        mass = opensim.Matrix()
        matter = model.getMatterSubsystem()
        matter.calcM(state, mass)
        n = len(coordinates)
        row |= {
            "q": q,
            "u": u,
            "M": [[mass.get(i, j) for j in range(n)] for i in range(n)],
            "bias": bias(passive, passive_state),
            "udot_passive": accelerations(passive, passive_state),
            "udot_muscle": udot,
            "body_pos": [
                [each.getPositionInGround(state).get(k) for k in range(3)] for each in bodies
            ],
            "body_R": [
                [
                    each.getTransformInGround(state).R().asMat33().get(i, j)
                    for i in range(3)
                    for j in range(3)
                ]
                for each in bodies
            ],
            "R": [
                [each.computeMomentArm(state, about) for about in coordinates] for each in muscles
            ],
            "act": a,
            "exc": e,
        }
        columns = {
            "L": lambda m: m.getLength(state),
            "V": lambda m: m.getLengtheningSpeed(state),
            "npts": lambda m: m.getGeometryPath().getCurrentPath(state).getSize(),
            "lf": lambda m: m.getFiberLength(state),
            "vf": lambda m: m.getFiberVelocity(state),
            "vfN": lambda m: m.getNormalizedFiberVelocity(state),
            "penn": lambda m: m.getPennationAngle(state),
            "lT": lambda m: m.getTendonLength(state),
            "fal": lambda m: m.getActiveForceLengthMultiplier(state),
            "fpe": lambda m: m.getPassiveForceMultiplier(state),
            "fv": lambda m: m.getForceVelocityMultiplier(state),
            "Fact": lambda m: m.getActiveFiberForce(state),
            "Fpass": lambda m: m.getPassiveFiberForce(state),
            "Ft": lambda m: m.getTendonForce(state),
            "Ffib_AT": lambda m: m.getFiberForceAlongTendon(state),
            "Finext_a1": lambda m: m.calcInextensibleTendonActiveFiberForce(state, 1.0),
            "lfdot": lambda m: rate(model, state, m, "fiber_length"),
            "adot": lambda m: rate(model, state, m, "activation"),
        }
        row |= {key: [value(each) for each in muscles] for key, value in columns.items()}
        row["eq_ok"] = np.ones(len(muscles), dtype=bool)
        rows.append(row)
    return {
        "coordinates": names,
        "muscles": [each.getName() for each in muscles],
        "bodies": [each.getName() for each in bodies],
    }, {key: np.array([row[key] for row in rows]) for key in rows[0]}


def rate(model, state, muscle, name):
    return model.getStateVariableDerivativeValue(state, f"{muscle.getAbsolutePathString()}/{name}")


def prescribed(model, courses):
    """Let excitations follow functions of time, by the names of muscles."""
    import opensim

    controller = opensim.PrescribedController()
    for each in muscles_of(model):
        controller.addActuator(each)
    for name, course in courses.items():
        controller.prescribeControlForActuator(name, course)
    model.addController(controller)


def integrated(model, state, times, read):
    """What `read` says of the state at the times, and of the last state of each step."""
    import opensim

    manager = opensim.Manager(model)
    manager.setIntegratorMethod(opensim.Manager.IntegratorMethod_RungeKuttaMerson)
    manager.setIntegratorAccuracy(ACCURACY)
    state.setTime(0.0)
    manager.initialize(state)
    rows = [read(state)]
    for time in times[1:]:
        state = manager.integrate(float(time))
        rows.append(read(state))
    return rows


def forward(name):
    """A motion under excitations that oscillate: coordinates, speeds, activations, fibres."""
    import opensim

    model = load(OWN[name]())
    muscles = muscles_of(model)
    waves = [
        {"offset": 0.3 + 0.05 * k, "amplitude": 0.2, "omega": 5.0 + 2.0 * k, "phase": 0.7 * k}
        for k in range(len(muscles))
    ]
    prescribed(
        model,
        {
            each.getName(): opensim.Sine(w["amplitude"], w["omega"], w["phase"], w["offset"])
            for each, w in zip(muscles, waves, strict=True)
        },
    )
    state = model.initSystem()
    for each, wave in zip(muscles, waves, strict=True):
        each.setActivation(state, wave["offset"])
    model.equilibrateMuscles(state)
    coordinates = coordinates_of(model, state)

    def read(state):
        model.realizeVelocity(state)
        return [
            state.getTime(),
            *(each.getValue(state) for each in coordinates),
            *(each.getSpeedValue(state) for each in coordinates),
            *(each.getActivation(state) for each in muscles),
            *(each.getFiberLength(state) for each in muscles),
        ]

    rows = integrated(model, state, np.arange(ROWS + 1) * (SPANS[name] / ROWS), read)
    paths = [each.getAbsolutePathString() for each in coordinates]
    labels = ["time", *(f"{path}/{what}" for what in ("value", "speed") for path in paths)]
    labels += [
        f"{each.getAbsolutePathString()}/{what}"
        for what in ("activation", "fiber_length") for each in muscles
    ]  # fmt: skip
    excitation = {each.getName(): wave for each, wave in zip(muscles, waves, strict=True)}
    stored = {"labels": np.array(labels), "data": np.array(rows)}
    return {"T": SPANS[name], "excitation": excitation}, stored


def unit_model(kind, pennation=SINGLE["pennation"], inside="<locked>true</locked>"):
    """A unit of one of the kinds between ground and a block on a rail."""
    of, properties = (KINDS | RIGID_KINDS)[kind]
    own = "".join(f"<{key}>{str(value).lower()}</{key}>" for key, value in properties.items())
    sizes = SINGLE | {"pennation": pennation}
    points = [("ground", "0 0 0"), ("block", "0 0 0")]
    length = coordinate("l", 0, 1, f"<default_value>{LENGTH}</default_value>{inside}")
    return load(MODEL.format(
        name="single",
        bodies=body("block", 1.0, "0 0 0", "1 1 1 0 0 0"),
        joints=joint("SliderJoint", "rail", "ground", "block", length),
        constraints="",
        forces=muscle(of, "unit", points, inside=own, **sizes),
    ))  # fmt: skip


def single(kind):
    """A unit at constant length: activation, tendon force and fibre length (rows, 3)."""
    import opensim

    model = unit_model(kind)
    (unit,) = muscles_of(model)
    course = opensim.PiecewiseLinearFunction()
    for time, excitation in zip(*RAMPS, strict=True):
        course.addPoint(time, excitation)
    prescribed(model, {"unit": course})
    state = model.initSystem()
    unit.setActivation(state, RAMPS[1][0])
    model.equilibrateMuscles(state)

    def read(state):
        model.realizeDynamics(state)
        return [unit.getActivation(state), unit.getTendonForce(state), unit.getFiberLength(state)]

    times = np.arange(round(RAMPS[0][-1] / SINGLE_ROW) + 1) * SINGLE_ROW
    return np.array(integrated(model, state, times, read))


def rigid():
    """Of units whose class has a rigid tendon: l, l', a, tendon force, fibre length, and active and
    passive fibre force (STATES, 7)."""
    import opensim

    found = {}
    for kind in RIGID_KINDS:
        model, rng = unit_model(kind, inside=""), np.random.default_rng(SEED)
        state = model.initSystem()
        (unit,), (length,) = muscles_of(model), coordinates_of(model, state)
        l = SINGLE["tendon"] + SINGLE["fiber"] * rng.uniform(0.35, 1.75, STATES)
        v = SINGLE["fiber"] * 10.0 * rng.uniform(-0.9, 0.9, STATES)
        a = rng.uniform(0.05, 1.0, STATES)
        rows = []
        for place, speed, activation in zip(l.tolist(), v.tolist(), a.tolist(), strict=True):
            length.setValue(state, place, False)
            length.setSpeedValue(state, speed)
            if kind == "splines":
                model.realizeVelocity(state)
                model.setControls(state, opensim.Vector([activation]))
            else:
                unit.setActivation(state, activation)
            model.realizeDynamics(state)
            rows.append((
                place, speed, activation, unit.getTendonForce(state), unit.getFiberLength(state),
                unit.getActiveFiberForce(state), unit.getPassiveFiberForce(state),
            ))  # fmt: skip
        found[kind] = np.array(rows)
    return found


def curves():
    """Name -> rows of x, value and derivative; of Thelen's force-velocity relation a, F, v, f_v."""
    import opensim

    lengths = np.linspace(0.06, 2.0, 98)
    speeds, tendons = np.linspace(-1.3, 1.3, 131), np.linspace(0.98, 1.1, 121)
    tables = {}
    model = unit_model("millard")
    model.initSystem()  # which makes the active curve that of a damped fibre
    millard = opensim.Millard2012EquilibriumMuscle.safeDownCast(muscles_of(model)[0])
    for name, curve, places in (
        ("fal", millard.getActiveForceLengthCurve(), lengths),
        ("fpe", millard.getFiberForceLengthCurve(), lengths),
        ("fv", millard.getForceVelocityCurve(), speeds),
        ("fse", millard.getTendonForceLengthCurve(), tendons),
    ):
        tables[f"millard_{name}"] = [
            (x, curve.calcValue(x), curve.calcDerivative(x, 1)) for x in places.tolist()
        ]
    dgf = opensim.DeGrooteFregly2016Muscle()
    for name, value, slope, places in (
        (
            "fal",
            dgf.calcActiveForceLengthMultiplier,
            dgf.calcActiveForceLengthMultiplierDerivative,
            lengths,
        ),
        ("fpe", dgf.calcPassiveForceMultiplier, dgf.calcPassiveForceMultiplierDerivative, lengths),
        ("fv", dgf.calcForceVelocityMultiplier, None, speeds),
        ("fse", dgf.calcTendonForceMultiplier, dgf.calcTendonForceMultiplierDerivative, tendons),
    ):
        tables[f"dgf_{name}"] = [
            (x, value(x), np.nan if slope is None else slope(x)) for x in places.tolist()
        ]
    for kind in ("thelen", "thelen_other"):
        tables |= {f"{kind}_{name}": rows for name, rows in thelen_curves(kind).items()}
    return tables


def thelen_curves(kind):
    """From units without pennation at chosen lengths of fibre and tendon."""
    import opensim

    model = unit_model(kind, pennation=0.0, inside="")
    state = model.initSystem()
    (unit,), (length,) = muscles_of(model), coordinates_of(model, state)
    own = opensim.Thelen2003Muscle.safeDownCast(unit)
    optimal, slack, F0 = SINGLE["fiber"], SINGLE["tendon"], SINGLE["force"]

    def at(fiber, tendon, a=0.5):
        length.setValue(state, fiber * optimal + tendon * slack)
        own.setActivation(state, a)
        own.setFiberLength(state, fiber * optimal)
        model.realizeDynamics(state)
        return unit

    found = {"fal": [], "fpe": [], "fse": [], "fv_a_F_vN_fv": []}
    for x in np.linspace(0.06, 2.0, 98).tolist():
        now = at(x, 1.01)
        found["fal"].append((x, now.getActiveForceLengthMultiplier(state), np.nan))
        found["fpe"].append((x, now.getPassiveForceMultiplier(state), np.nan))
    for x in np.linspace(0.98, 1.1, 121).tolist():
        found["fse"].append((x, at(1.0, x).getTendonForce(state) / F0, np.nan))
    for a in (0.05, 0.25, 0.5, 0.75, 1.0):
        for stretch in np.linspace(1.0, 1.045, 41).tolist():
            now = at(1.0, stretch, a)
            found["fv_a_F_vN_fv"].append((
                a, now.getTendonForce(state) / F0, now.getNormalizedFiberVelocity(state),
                now.getForceVelocityMultiplier(state),
            ))  # fmt: skip
    return found


def passive():
    """Random states q, u (STATES, n) of the model of passive forces, each force there, and the end
    of a run from the first of them."""
    import opensim

    bare = load(passive_models.model(muscles=False))
    free, rng = bare.initSystem(), np.random.default_rng(SEED)
    coordinates = coordinates_of(bare, free)
    ranges = [(each.getRangeMin(), each.getRangeMax()) for each in coordinates]
    q = rng.uniform(*np.transpose(ranges), (STATES, len(ranges)))
    u = rng.uniform(-1.0, 1.0, q.shape)
    found = {"q": q, "u": u, "names": np.array([each.getName() for each in coordinates])}
    for name in passive_models.FORCES:
        model = load(passive_models.model(name, muscles=False))
        state = model.initSystem()
        found[name] = added(model, state, q, u, bare, free)
        for each, x, v in zip(coordinates_of(model, state), q[0], u[0], strict=True):
            each.setValue(state, float(x), False)
            each.setSpeedValue(state, float(v))
        read = [each.getValue for each in coordinates_of(model, opensim.State(state))]
        times = [0.0, passive_models.SPAN]
        ends = integrated(model, state, times, lambda now, read=read: [at(now) for at in read])
        found[f"{name}_end"] = np.array(ends[-1])
    pushing = load(
        passive_models.model(muscles=False).replace(
            "<ForceSet><objects>", f"<ForceSet><objects>{passive_models.PUSHING}"
        )
    )
    state = pushing.initSystem()
    actuator = opensim.ScalarActuator.safeDownCast(pushing.getForceSet().get("pushing"))
    actuator.overrideActuation(state, True)
    actuator.setOverrideActuation(state, 1.0)
    found["pushing"] = added(pushing, state, q, u, bare, free)
    return found


def added(model, state, q, u, bare, free):
    """What forces a model has that another one with its own state has not (STATES, n)."""
    rows = []
    for place, speed in zip(q.tolist(), u.tolist(), strict=True):
        for each, x, v in zip(coordinates_of(model, state), place, speed, strict=True):
            each.setValue(state, x, False)
            each.setSpeedValue(state, v)
        free.setQ(state.getQ())
        free.setU(state.getU())
        rows.append(bias(bare, free) - bias(model, state))
    return np.array(rows)


def joints():
    """Random states of the models of joints: q, q', q'' (STATES, n), the last body's orientation
    and position (STATES, 12), and the names of the coordinates and of those that are angles."""
    import opensim

    found = {}
    for name in joint_models.JOINTS:
        model, rng = load(joint_models.model(name)), np.random.default_rng(SEED)
        state, rows = model.initSystem(), []
        set_ = model.getCoordinateSet()
        coordinates = [set_.get(k) for k in range(set_.getSize())]
        for _ in range(STATES):
            q = rng.uniform(-0.5, 0.5, len(coordinates))
            u = rng.uniform(-2.0, 2.0, q.size) * (name not in joint_models.AT_REST)
            for each, value, speed in zip(coordinates, q, u, strict=True):
                each.setValue(state, float(value), False)
                each.setSpeedValue(state, float(speed))
            model.realizeAcceleration(state)
            Q = vector(state.getQ())
            at = [int(np.abs(Q - value).argmin()) for value in q]  # unused ones stand between them
            H = bodies_of(model)[-1].getTransformInGround(state)
            R = [H.R().asMat33().get(i, j) for i in range(3) for j in range(3)]
            place = [*R, *(H.p().get(k) for k in range(3))]
            rows.append([q, vector(state.getQDot())[at], vector(state.getQDotDot())[at], place])
        q, u, a, places = (np.array(row) for row in zip(*rows, strict=True))
        angles = [
            each.getName()
            for each in coordinates
            if each.getMotionType() == opensim.Coordinate.Rotational
        ]
        found |= {f"{name}_q": q, f"{name}_u": u, f"{name}_a": a, f"{name}_places": places}
        found[f"{name}_names"] = np.array([each.getName() for each in coordinates])
        found[f"{name}_angles"] = np.array(angles)
    return found


def loops():
    """Falls of the chain whose loops are closed, from rest (ROWS + 1, n): q, u, the accelerations
    without muscles, and those with tendon forces (m,)."""
    found = {}
    for name in loop_models.CONSTRAINTS:
        model, pulled = load(loop_models.model(name)), load(loop_models.model(name))
        for each in muscles_of(model):
            each.set_appliesForce(False)
        state, there = model.initSystem(), pulled.initSystem()
        coordinates = [model.getCoordinateSet().get(each) for each in loop_models.DEFAULTS]
        rows = {key: [] for key in ("q", "u", "a", "a_muscles", "F")}

        def read(now, model=model, pulled=pulled, there=there, coordinates=coordinates, rows=rows):
            model.realizeAcceleration(now)
            there.setQ(now.getQ())
            there.setU(now.getU())
            for each in muscles_of(pulled):
                each.setActivation(there, 0.4)
            pulled.equilibrateMuscles(there)
            pulled.realizeAcceleration(there)
            values = {
                "q": [each.getValue(now) for each in coordinates],
                "u": [each.getSpeedValue(now) for each in coordinates],
                "a": [each.getAccelerationValue(now) for each in coordinates],
                "a_muscles": [
                    pulled.getCoordinateSet().get(each.getName()).getAccelerationValue(there)
                    for each in coordinates
                ],
                "F": [each.getTendonForce(there) for each in muscles_of(pulled)],
            }
            for key, value in values.items():
                rows[key].append(value)

        times = np.arange(loop_models.ROWS + 1) * (loop_models.SPAN / loop_models.ROWS)
        integrated(model, state, times, read)
        found |= {f"{name}_{key}": np.array(value) for key, value in rows.items()}
    return found


def torus():
    """Lengths (STATES,) of the muscle through a ring by its sides, and q (STATES, n)."""
    ranges = np.transpose(list(torus_model.RANGES.values()))
    q = np.random.default_rng(SEED).uniform(*ranges, (STATES, len(torus_model.RANGES)))
    found = {"q": q}
    for side in torus_model.SIDES:
        model, lengths = load(torus_model.model(side)), []
        state = model.initSystem()
        for row in q.tolist():
            for name, value in zip(torus_model.RANGES, row, strict=True):
                model.getCoordinateSet().get(name).setValue(state, value, False)
            model.realizePosition(state)
            lengths.append(muscles_of(model)[0].getLength(state))
        found[side] = np.array(lengths)
    return found


def cylinders():
    """Places of both ends (STATES, 6) of a muscle over a cylinder, and its lengths by the sides."""
    rng = np.random.default_rng(SEED)
    q = rng.uniform(-1.0, 1.0, (10 * STATES, 6)) * np.tile(cylinder_model.SPREAD, 2)
    found = {"q": q}
    for side in cylinder_model.SIDES:
        model, lengths = load(cylinder_model.model(side)), []
        state = model.initSystem()
        for row in q.tolist():
            for name, value in zip("".join(cylinder_model.POINTS.values()), row, strict=True):
                model.getCoordinateSet().get(name).setValue(state, value, False)
            model.realizePosition(state)
            lengths.append(muscles_of(model)[0].getLength(state))
        found[side] = np.array(lengths)
    return found


def noisy():
    """Times (121,) and samples (121, 2) of a recorded motion."""
    t = np.arange(121) / 100.0
    noise = 0.01 * np.random.default_rng(SEED).standard_normal((len(t), 2))
    return t, np.column_stack([np.sin(3.0 * t), 0.5 - np.cos(5.0 * t)]) + noise


def noisy_storage():
    """The same in OpenSim."""
    import opensim

    storage = opensim.Storage()
    labels = opensim.ArrayStr()
    for label in ("time", "one", "two"):
        labels.append(label)
    storage.setColumnLabels(labels)
    for time, row in zip(*(values.tolist() for values in noisy()), strict=True):
        storage.append(opensim.StateVector(time, opensim.Vector(row)))
    return storage


def filtered():
    """What OpenSim's CMC makes of it: values and second derivatives (3, 2) at the times `at`."""
    import opensim

    storage = noisy_storage()
    storage.pad(60)
    storage.lowpassFIR(50, 6.0)
    splines = opensim.GCVSplineSet(5, storage)
    at = [0.0, 0.25, 1.2]
    values = [
        [[splines.evaluate(k, order, time) for k in range(2)] for time in at] for order in (0, 2)
    ]
    return {"at": np.array(at), "q": np.array(values[0]), "a": np.array(values[1])}


def stored_files():
    """Name -> content of files with these numbers, as OpenSim writes them now and did before."""
    import opensim

    storage = noisy_storage()
    storage.setName("noisy")
    storage.setInDegrees(True)
    table = opensim.TimeSeriesTable()
    table.setColumnLabels(["/jointset/shoulder/one/value", "/forceset/two/activation"])
    for time, row in zip(*(values.tolist() for values in noisy()), strict=True):
        table.appendRow(time, opensim.RowVector(row))
    table.addTableMetaDataString("inDegrees", "no")
    with TemporaryDirectory() as folder:
        storage.printResult(storage, "noisy", folder, -1.0, ".mot")
        opensim.STOFileAdapter.write(table, str(Path(folder) / "noisy.sto"))
        return {name: (Path(folder) / name).read_bytes() for name in ("noisy.mot", "noisy.sto")}


# What static optimizations ask for; without the model's forces OpenSim 4.6 crashes.
ASKED = {
    "squares": {},
    "cubes": {"activation_exponent": 3},
    "isometric": {"use_muscle_physiology": "false"},
}


def cmc():
    """The states of OpenSim's CMC: labels, and rows (k, c) with the time first."""
    import opensim

    times = np.arange(0.04, 0.5901, 0.01)
    results = {"states": "blocks_states.sto", "errors": "blocks_pErr.sto"}
    return tool_results(cmc_files(), SETUP, opensim.CMCTool, results, times)


def static_optimizations():
    """Activations and forces of OpenSim's static optimizations, as `cmc`."""
    import opensim

    times = np.arange(0.1, 0.6001, 0.01)
    found = {}
    for name, asked in ASKED.items():
        results = {
            f"{name}_{kind}": f"blocks_StaticOptimization_{kind}.sto"
            for kind in ("activation", "force")
        }
        files = static_files(**asked)
        found |= tool_results(files, STATIC, opensim.AnalyzeTool, results, times)
    return found


def tool_results(files, setup, tool_class, results, times):
    """What a tool of OpenSim writes: the labels and rows of files by names, at these times."""
    import opensim

    with TemporaryDirectory() as folder:
        for name, text in files.items():
            (Path(folder) / name).write_text(text)
        before = os.getcwd()
        os.chdir(folder)
        try:
            if not tool_class(setup).run():
                raise SystemExit(f"OpenSim gave up with {setup}")
            storages = {key: opensim.Storage(f"results/{file}") for key, file in results.items()}
        finally:
            os.chdir(before)
    found = {}
    for key, storage in storages.items():
        names = storage.getColumnLabels()
        columns = []
        for k in range(1, names.size()):
            time, values = opensim.ArrayDouble(), opensim.ArrayDouble()
            storage.getTimeColumn(time)
            storage.getDataColumn(names.get(k), values)
            pair = ([each.get(i) for i in range(each.size())] for each in (time, values))
            columns.append(np.interp(times, *pair))
        found[f"{key}_labels"] = np.array([names.get(k) for k in range(names.size())])
        found[key] = np.column_stack([times, *columns])
    return found


def main():
    FOLDER.mkdir(exist_ok=True)
    for name in OWN:
        for kind, make in (("static", static), ("forward", forward)):
            facts, arrays = make(name)
            write_file(
                FOLDER / f"{name}_{kind}.json", (json.dumps(facts, indent=1) + "\n").encode()
            )
            write_arrays(FOLDER / f"{name}_{kind}.npz", **arrays)
            print(name, kind)
    write_arrays(FOLDER / "curves.npz", **{key: np.array(rows) for key, rows in curves().items()})
    # De Groote's class keeps the time constants of a process's first unit for all others.
    one_each = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), max_tasks_per_child=1)
    with one_each as pool:
        write_arrays(
            FOLDER / "single.npz", **dict(zip(KINDS, pool.map(single, KINDS), strict=True))
        )
    write_arrays(FOLDER / "rigid.npz", **rigid())
    write_arrays(FOLDER / "passive.npz", **passive())
    write_arrays(FOLDER / "joints.npz", **joints())
    write_arrays(FOLDER / "loops.npz", **loops())
    write_arrays(FOLDER / "torus.npz", **torus())
    write_arrays(FOLDER / "cylinders.npz", **cylinders())
    write_arrays(FOLDER / "filtered.npz", **filtered())
    for name, content in stored_files().items():
        write_file(FOLDER / name, content)
    write_arrays(FOLDER / "cmc.npz", **cmc())
    write_arrays(FOLDER / "static_optimizations.npz", **static_optimizations())


if __name__ == "__main__":
    main()
