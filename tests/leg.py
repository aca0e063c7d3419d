"""A planar leg whose knee slides and whose foot follows the knee, and its equations on their own.

Coordinates of the tree: hip, knee_x and knee_y (cubics of the knee), knee, ankle (linear in the
knee) and toes, which follow the ankle: a point mass on its own axis, so that the tree's M is
singular. The links between thigh and shank are massless.
"""

from functools import partial

import exudyn as exu
import numpy as np
from exudyn.utilities import HTtranslate, RigidBodyInertia, TreeLink
from numpy.polynomial import Polynomial

import exudyn_muscles as em

NAMES = ("hip", "knee_x", "knee_y", "knee", "ankle", "toes")
GRAVITY = np.array([0.4, -9.81])
THIGH, SHANK, FOOT = (
    (7.0, 0.12, (0.01, -0.19)),
    (3.5, 0.05, (0.0, -0.2)),
    (1.1, 0.006, (0.05, -0.03)),
)
HIP_TO_KNEE, KNEE_TO_ANKLE, ANKLE_TO_TOES = (0.0, -0.4), (0.0, -0.42), (0.14, -0.04)
TOES_MASS = 0.2
KNEE_X = Polynomial([0.005, -0.03, -0.02, 0.006])
KNEE_Y = Polynomial([-0.01, 0.004, 0.012, 0.003])
ANKLE = Polynomial([0.1, -0.4])
TOES = Polynomial([0.0, 0.2, 0.3])
KNOTS = np.linspace(-3.0, 3.0, 4)

HALF = {"max_isometric_force": 4000.0, "optimal_fiber_length": 0.12}
MUSCLES = {  # tendon slack length, points (link or -1, x, y)
    "hip_flexor": (0.19, [(-1, 0.08, 0.05), (0, 0.04, -0.23)]),
    "hip_extensor": (0.19, [(-1, -0.08, 0.05), (0, -0.04, -0.23)]),
    "knee_extensor": (0.25, [(0, 0.05, -0.1), (0, 0.05, -0.36), (3, 0.04, -0.07)]),
    "knee_flexor": (0.25, [(0, -0.04, -0.1), (0, -0.05, -0.36), (3, -0.03, -0.08)]),
    "biarticular": (0.42, [(-1, -0.06, -0.02), (0, -0.05, -0.36), (3, -0.03, -0.1)]),
    "calf": (0.36, [(0, -0.03, -0.36), (3, -0.04, -0.1), (4, -0.05, -0.03)]),
}  # fmt: skip


def spline(polynomial):
    """A cubic is its own spline."""
    return em.simm_spline(KNOTS, polynomial(KNOTS))


def dependent_coordinates():
    return [
        em.DependentCoordinate("toes", of="ankle", function=em.Curve(TOES, [-2.0, 2.0])),
        em.DependentCoordinate("knee_x", of="knee", function=spline(KNEE_X)),
        em.DependentCoordinate("knee_y", of="knee", function=spline(KNEE_Y)),
        em.DependentCoordinate(
            "ankle", of="knee", function=em.linear_function(ANKLE.coef[1], ANKLE.coef[0])
        ),
    ]


def links(toes_moment=0.0):
    inertia = partial(RigidBodyInertia, inertiaTensorAtCOM=True)
    massless = RigidBodyInertia(mass=0.0, inertiaTensor=np.zeros((3, 3)))
    kind = exu.JointType

    def body(mass, moment, com):
        return inertia(mass=mass, inertiaTensor=np.diag([moment] * 3), com=[*com, 0.0])

    joints = [
        (kind.RevoluteZ, (0.0, 0.0), body(*THIGH)),
        (kind.PrismaticX, HIP_TO_KNEE, massless),
        (kind.PrismaticY, (0.0, 0.0), massless),
        (kind.RevoluteZ, (0.0, 0.0), body(*SHANK)),
        (kind.RevoluteZ, KNEE_TO_ANKLE, body(*FOOT)),
        (kind.RevoluteZ, ANKLE_TO_TOES, body(TOES_MASS, toes_moment, (0.0, 0.0))),
    ]
    return [
        TreeLink(jointType=joint, parent=i - 1, jointHT=HTtranslate([*at, 0.0]), linkInertia=link)
        for i, (joint, at, link) in enumerate(joints)
    ]


def build(muscles=None, extend=None, toes_moment=0.0, **more):
    """The model; `extend(mbs, tree)` adds what else belongs to it."""
    mbs = exu.SystemContainer().AddSystem()
    tree = mbs.CreateKinematicTree(
        listOfTreeLinks=links(toes_moment), gravity=[*GRAVITY, 0.0], **more
    )
    if extend is not None:
        extend(mbs, tree)
    mbs.Assemble()
    if muscles is None:
        muscles = [
            em.Muscle(
                name, **HALF, tendon_slack_length=slack,
                path=[em.PathPoint([x, y, 0.0], link=link) for link, x, y in path],
            )
            for name, (slack, path) in MUSCLES.items()
        ]  # fmt: skip
    return em.MusculoskeletalModel(
        mbs, tree, muscles, coordinates=NAMES, dependent_coordinates=dependent_coordinates()
    )


def idle():
    """A muscle that acts on nothing."""
    path = [em.PathPoint([0.0, 0.0, 0.0]), em.PathPoint([0.25, 0.0, 0.0])]
    return em.Muscle("idle", **HALF, tendon_slack_length=0.13, path=path)


def motion():
    return em.Motion.from_waypoints(
        [0.0, 0.3, 0.6, 1.0], [[0.1, -0.3], [0.5, -1.1], [0.2, -0.5], [0.3, -0.8]]
    )


# The equations of motion in hip and knee, from the accelerations of the centres of mass.


def along(polynomial, x, v, a):
    """Value and two time derivatives of a function of a coordinate."""
    slope = polynomial.deriv()
    return polynomial(x), slope(x) * v, slope(x) * a + slope.deriv()(x) * v * v


def turned(angle, c):
    """R(angle) c and two time derivatives, of triples."""
    S = np.array([[0.0, -1.0], [1.0, 0.0]])
    R = np.cos(angle[0]) * np.eye(2) + np.sin(angle[0]) * S
    w, alpha = angle[1:]
    return (
        R @ c[0],
        R @ (c[1] + w * S @ c[0]),
        R @ (c[2] + 2.0 * w * S @ c[1] + alpha * S @ c[0] - w * w * c[0]),
    )


def fixed(c):
    return np.array(c, dtype=float), np.zeros(2), np.zeros(2)


def added(*triples):
    return tuple(sum(parts) for parts in zip(*triples, strict=True))


def bodies(z, v, a):
    """Mass, moment, centre and angle of thigh, shank, foot and toes, with time derivatives."""
    hip, knee = zip(z, v, a, strict=True)
    x, y, ankle = (along(f, *knee) for f in (KNEE_X, KNEE_Y, ANKLE))
    shift = tuple(np.array(pair) for pair in zip(x, y, strict=True))
    shank, foot = added(hip, knee), added(hip, knee, ankle)
    knee_at = turned(hip, added(fixed(HIP_TO_KNEE), shift))
    ankle_at = added(knee_at, turned(shank, fixed(KNEE_TO_ANKLE)))
    return [
        (*THIGH[:2], turned(hip, fixed(THIGH[2])), hip),
        (*SHANK[:2], added(knee_at, turned(shank, fixed(SHANK[2]))), shank),
        (*FOOT[:2], added(ankle_at, turned(foot, fixed(FOOT[2]))), foot),
        (TOES_MASS, 0.0, added(ankle_at, turned(foot, fixed(ANKLE_TO_TOES))), foot),
    ]


def equations(z, v):
    """M_z (2, 2) and H_z - Q_z (2,)."""
    rest = np.zeros(2)
    rates = [bodies(z, e, rest) for e in np.eye(2)]
    M, bias = np.zeros((2, 2)), np.zeros(2)
    for k, (mass, moment, centre, angle) in enumerate(bodies(z, v, rest)):
        J = np.array([rate[k][2][1] for rate in rates])  # (2 coordinates, x and y)
        w = np.array([rate[k][3][1] for rate in rates])
        M += mass * J @ J.T + moment * np.outer(w, w)
        bias += mass * J @ (centre[2] - GRAVITY) + moment * w * angle[2]
    return M, bias


def energy(z, v):
    return sum(
        0.5 * mass * centre[1] @ centre[1]
        + 0.5 * moment * angle[1] ** 2
        - mass * GRAVITY @ centre[0]
        for mass, moment, centre, angle in bodies(z, v, np.zeros(2))
    )


def tree_coordinates(z):
    hip, knee = z
    ankle = ANKLE(knee)
    return np.array([hip, KNEE_X(knee), KNEE_Y(knee), knee, ankle, TOES(ankle)])
