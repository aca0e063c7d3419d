"""Numbers of OpenSim's deprecated muscle classes at random states, from its wheel:

    python -m tests.muscle.make_deprecated

writes `tests/reference/deprecated_muscles.npz`, for `test_deprecated.py`.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from exudyn_muscles.files.disk import write_arrays

FILE = Path(__file__).parents[1] / "reference" / "deprecated_muscles.npz"
STATES = 200
COLUMNS = (
    "activation", "excitation", "fiber_length", "length", "speed",
    "force", "fiber_velocity", "activation_rate",
)  # fmt: skip

SIZES = {
    "max_isometric_force": 800.0,
    "optimal_fiber_length": 0.09,
    "tendon_slack_length": 0.2,
    "pennation_angle_at_optimal": 0.3,
}
TENDON = ([-10, -0.002, -0.001, 0, 0.002, 0.006, 0.012, 0.03, 0.06, 5, 10],
          [0, 0, 0, 0, 0.02, 0.09, 0.3, 1.0, 2.2, 200, 400])  # fmt: skip
ACTIVE = ([-5, 0, 0.4, 0.5, 0.7, 0.9, 1.05, 1.3, 1.6, 1.8, 2.2, 5],
          [0, 0, 0, 0.1, 0.7, 0.97, 0.99, 0.6, 0.1, 0, 0, 0])  # fmt: skip
PASSIVE = ([-5, 0.99, 1, 1.15, 1.3, 1.45, 1.6, 1.75, 5], [0, 0, 0, 0.02, 0.1, 0.3, 0.9, 2, 40])


def spline(name, points):
    x, y = (" ".join(map(str, row)) for row in points)
    return f'<SimmSpline name="{name}"><x>{x}</x><y>{y}</y></SimmSpline>'


# A muscle by its class and what its file says beside its sizes.
MUSCLES = {
    "Thelen": ("Thelen2003Muscle_Deprecated", ""),
    "Thelen, other": (
        "Thelen2003Muscle_Deprecated",
        "<activation_time_constant>0.015</activation_time_constant><deactivation_time_constant>0.06"
        "</deactivation_time_constant><Vmax>8</Vmax><Vmax0>2</Vmax0><FmaxTendonStrain>0.05"
        "</FmaxTendonStrain><FmaxMuscleStrain>0.5</FmaxMuscleStrain><KshapeActive>0.4"
        "</KshapeActive><KshapePassive>5</KshapePassive><damping>0.2</damping><Af>0.25</Af><Flen>"
        "1.4</Flen><max_contraction_velocity>12</max_contraction_velocity>",
    ),
    "Thelen, undamped": ("Thelen2003Muscle_Deprecated", "<damping>0</damping>"),
    "Schutte": ("Schutte1993Muscle_Deprecated", ""),
    "Schutte, other": (
        "Schutte1993Muscle_Deprecated",
        "<time_scale>0.12</time_scale><activation1>5</activation1><activation2>2</activation2>"
        "<damping>0.05</damping><max_contraction_velocity>12</max_contraction_velocity>"
        + spline("tendon_force_length_curve", TENDON)
        + spline("active_force_length_curve", ACTIVE)
        + spline("passive_force_length_curve", PASSIVE),
    ),
}  # fmt: skip


def model(muscle):
    """Text of a model file: a muscle from the origin to a body on a slider."""
    kind, inside = MUSCLES[muscle]
    inside += "".join(f"<{name}>{value}</{name}>" for name, value in SIZES.items())
    point = (
        '<PathPoint name="{}"><socket_parent_frame>{}</socket_parent_frame>'
        "<location>0 0 0</location></PathPoint>"
    )
    points = point.format("a", "/ground") + point.format("b", "/bodyset/body")
    return (
        '<?xml version="1.0"?><OpenSimDocument Version="40000"><Model name="model"><BodySet>'
        '<objects><Body name="body"><mass>1</mass><mass_center>0 0 0</mass_center>'
        "<inertia>1 1 1 0 0 0</inertia></Body></objects></BodySet><JointSet><objects>"
        '<SliderJoint name="joint"><socket_parent_frame>/ground</socket_parent_frame>'
        "<socket_child_frame>/bodyset/body</socket_child_frame><coordinates>"
        '<Coordinate name="length"/></coordinates></SliderJoint></objects></JointSet><ForceSet>'
        f'<objects><{kind} name="muscle"><GeometryPath name="path"><PathPointSet><objects>{points}'
        f"</objects></PathPointSet></GeometryPath>{inside}</{kind}></objects></ForceSet></Model>"
        "</OpenSimDocument>"
    )


def states(rng):
    """Random states, and the derivatives' arguments: (STATES, 5)."""
    l_0, l_ts = SIZES["optimal_fiber_length"], SIZES["tendon_slack_length"]
    a, u = rng.uniform(0.01, 1.0, (2, STATES))
    a[::4] = 0.01
    l_m = l_0 * rng.uniform(0.35, 1.75, STATES)
    l_t = l_ts * (1.0 + rng.uniform(-0.005, 0.03, STATES))
    l = l_t + np.sqrt(l_m**2 - (l_0 * np.sin(SIZES["pennation_angle_at_optimal"])) ** 2)
    return np.column_stack([a, u, l_m, l, rng.uniform(-10.0, 10.0, STATES) * l_0])


def answers(file, rows):
    """What OpenSim says there: force, fibre velocity and activation rate (STATES, 3)."""
    import opensim

    system = opensim.Model(str(file))
    state = system.initSystem()
    muscle = system.getMuscles().get(0)
    coordinate = system.getCoordinateSet().get(0)
    found = []
    for a, u, l_m, l, speed in rows:
        coordinate.setValue(state, l)  # first: it drops what is kept of the state before
        coordinate.setSpeedValue(state, speed)
        system.setStateVariableValue(state, "/forceset/muscle/activation", a)
        system.setStateVariableValue(state, "/forceset/muscle/fiber_length", l_m)
        controls = opensim.Vector(1, u)
        system.realizeVelocity(state)
        system.setControls(state, controls)
        system.realizeAcceleration(state)
        rates = [
            system.getStateVariableDerivativeValue(state, f"/forceset/muscle/{name}")
            for name in ("fiber_length", "activation")
        ]
        found.append([muscle.getActuation(state), *rates])
    return np.array(found)


if __name__ == "__main__":
    tables = {}
    with TemporaryDirectory() as folder:
        for number, name in enumerate(MUSCLES):
            rows = states(np.random.default_rng(number))
            file = Path(folder) / "model.osim"
            file.write_text(model(name))
            tables[name] = np.column_stack([rows, answers(file, rows)])
    write_arrays(FILE, **tables)
