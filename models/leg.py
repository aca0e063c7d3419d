"""A right leg that steps under a pelvis fixed in ground: six coordinates, 19 muscles.

x forward, y up, z to the right; all angles are zero in upright standing. Hip flexion, adduction and
internal rotation, knee extension, ankle dorsiflexion and subtalar inversion count positive. While
the knee turns the shank slides on the femur, by two dependent coordinates on massless links; the
talus is massless, too. There is no patella: the quadriceps ends at points that move on the shank.

Sources
-------
Joints, paths, strengths and lengths of muscles: S. L. Delp, J. P. Loan, M. G. Hoy, F. E. Zajac, E.
L. Topp, J. M. Rosen, "An interactive graphics-based model of the lower extremity to study
orthopaedic surgical procedures", IEEE Trans. Biomed. Eng. 37 (1990) 757-767, with the strengths and
lengths that D. G. Thelen, A. Seth, F. C. Anderson and S. L. Delp gave it in OpenSim's gait2392,
which is 1.8 m tall and weighs 75 kg. Where several actuators are one here their strengths are
added, all else is of the one named first in the table. The extensor of the toes lacks its 63 mm
along the toes, in path and tendon. Where points come and go, at 45 deg of hip flexion and at 45 to
84 deg in the knee, lengths jump by 0.6 mm at most. 10 optimal fibre lengths/s: OpenSim.

Knee: G. T. Yamaguchi, F. E. Zajac, "A planar model of the knee joint to characterize the knee
extensor mechanism", J. Biomech. 22 (1989) 1-10, as in Delp et al.

Surface behind the knee, in place of a point that comes and goes: A. Rajagopal et al., "Full-body
musculoskeletal model for muscle-driven simulation of human gait", IEEE Trans. Biomed. Eng. 63
(2016) 2068-2079.

Segments: P. de Leva, "Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters", J.
Biomech. 29 (1996) 1223-1230, table 4, men, for 75 kg, over the lengths between Delp's joints; the
length of the foot: D. A. Winter, "Biomechanics and Motor Control of Human Movement" (4th ed., 2009,
figure 4.1).

Motion: this project's own step of 1 s.
"""

import exudyn as exu
import numpy as np
from exudyn.utilities import HomogeneousTransformation, RigidBodyInertia, TreeLink

import exudyn_muscles as em

BODY_MASS, HEIGHT = 75.0, 1.80  # kg, m

COORDINATES = (
    "hip_flexion", "hip_adduction", "hip_rotation", "knee_x", "knee_y", "knee", "ankle", "subtalar",
)  # fmt: skip
PELVIS = None  # ground; its frame is Delp's, between the anterior superior iliac spines
THIGH, SHANK, FOOT = 2, 5, 7  # links, as the coordinates before them

# Delp et al.: joint centers in the frame of the segment above [m], and axes.
HIP = (-0.0707, -0.0661, 0.0835)
ANKLE, ANKLE_AXIS = (0.0, -0.43, 0.0), (-0.105, -0.174, 0.979)
SUBTALAR, SUBTALAR_AXIS = (-0.04877, -0.04195, 0.00792), (0.787, 0.605, -0.121)

# Yamaguchi and Zajac: where the shank is on the thigh [m] at an angle of the knee [rad].
KNEE_X = (
    [-2.0944, -1.74533, -1.39626, -1.0472, -0.698132, -0.349066, -0.174533, 0.197344],
    [-0.0032, 0.00179, 0.00411, 0.0041, 0.00212, -0.001, -0.0031, -0.005227],
)
KNEE_Y = (
    [-2.0944, -1.22173, -0.523599, -0.349066, -0.174533, 0.159149],
    [-0.4226, -0.4082, -0.399, -0.3976, -0.3966, -0.395264],
)

# de Leva: mass over body mass, length [m], center of mass and radii of gyration about x, y, z over
# length. Thigh and shank reach from joint to joint, the foot forward from its origin at the heel.
SEGMENTS = {
    THIGH: (0.1416, 0.396, (0.0, -0.4095, 0.0), (0.329, 0.149, 0.329)),
    SHANK: (0.0433, 0.430, (0.0, -0.4395, 0.0), (0.251, 0.102, 0.246)),
    FOOT: (0.0137, 0.152 * HEIGHT, (0.4415, 0.0, 0.0), (0.124, 0.257, 0.245)),
}

# Delp et al.: where the quadriceps ends on the shank, x and y [m], at an angle of the knee [rad];
# every second or third of their knots.
KNEE_ANGLES = [-2.0944, -1.5708, -1.0472, -0.698132, -0.349066, -0.174533, 0.0, 0.0872665, 0.174533]
RECTUS_END = (
    [0.0156, 0.0275, 0.0366, 0.0422, 0.0484, 0.0534, 0.0618, 0.0670, 0.0733],
    [0.0234, 0.0251, 0.0249, 0.0242, 0.0234, 0.0228, 0.0210, 0.0192, 0.0160],
)
VASTI_END = (
    [0.0083, 0.0202, 0.0293, 0.0349, 0.0413, 0.0465, 0.0555, 0.0613, 0.0684],
    [0.0256, 0.0273, 0.0271, 0.0266, 0.0261, 0.0260, 0.0253, 0.0242, 0.0218],
)


def _moving(ends: tuple[list[float], list[float]], z: float) -> em.MovingPathPoint:
    """A point that moves on the shank while the knee turns."""
    x, y = (em.simm_spline(KNEE_ANGLES, values) for values in ends)
    return em.MovingPathPoint(x, y, z, SHANK, coordinate="knee")


# Name: F0 [N], optimal fiber length [m], tendon slack length [m], pennation [deg], path (segment,
# x, y, z) [m]; after it the actuators of gait2392.
MUSCLES = {
    "gluteus_maximus": (  # glut_max2, 1, 3
        1944.0, 0.147, 0.127, 0.0,
        [(PELVIS, -0.1349, 0.0176, 0.0563), (PELVIS, -0.1376, -0.0520, 0.0914),
         (THIGH, -0.0426, -0.0530, 0.0293), (THIGH, -0.0156, -0.1016, 0.0419)],
    ),
    "gluteus_medius_anterior": (  # glut_med1
        819.0, 0.0535, 0.078, 8.0,
        [(PELVIS, -0.0408, 0.0304, 0.1209), (THIGH, -0.0218, -0.0117, 0.0555)],
    ),
    "gluteus_medius_posterior": (  # glut_med3, 2
        1226.0, 0.0646, 0.053, 19.0,
        [(PELVIS, -0.1223, 0.0105, 0.0648), (THIGH, -0.0309, -0.0047, 0.0518)],
    ),
    "iliopsoas": (  # iliacus, psoas
        2186.0, 0.100, 0.100, 7.0,
        [(PELVIS, -0.0674, 0.0365, 0.0854), (PELVIS, -0.0258, -0.0550, 0.0811),
         em.ConditionalPathPoint(
             [-0.0288, -0.0805, 0.0816], coordinate="hip_flexion", range=(-1.5708, 0.785398)),
         (THIGH, 0.0017, -0.0543, 0.0057), (THIGH, -0.0193, -0.0621, 0.0129)],
    ),
    "adductor_longus": (  # add_long
        627.0, 0.138, 0.110, 6.0,
        [(PELVIS, -0.0316, -0.0836, 0.0169), (THIGH, 0.0050, -0.2111, 0.0234)],
    ),
    "adductor_magnus": (  # add_mag2, 1, 3
        1212.0, 0.121, 0.120, 3.0,
        [(PELVIS, -0.0831, -0.1192, 0.0308), (THIGH, 0.0054, -0.2285, 0.0227)],
    ),
    "tensor_fasciae_latae": (  # tfl
        233.0, 0.095, 0.425, 3.0,
        [(PELVIS, -0.0311, 0.0214, 0.1241), (THIGH, 0.0294, -0.0995, 0.0597),
         (THIGH, 0.0054, -0.4049, 0.0357), (SHANK, 0.0060, -0.0487, 0.0297)],
    ),
    "piriformis": (  # peri
        444.0, 0.026, 0.115, 10.0,
        [(PELVIS, -0.1396, 0.0003, 0.0235), (PELVIS, -0.1193, -0.0276, 0.0657),
         (THIGH, -0.0148, -0.0036, 0.0437)],
    ),
    "medial_hamstrings": (  # semiten, semimem
        1698.0, 0.201, 0.2555, 5.0,
        [(PELVIS, -0.1264, -0.1099, 0.0604), (SHANK, -0.0332, -0.0528, -0.0229),
         (SHANK, -0.0113, -0.0746, -0.0245), (SHANK, 0.0027, -0.0956, -0.0193)],
    ),
    "biceps_femoris_long": (  # bifemlh
        896.0, 0.109, 0.326, 0.0,
        [(PELVIS, -0.1260, -0.1026, 0.0694), (SHANK, -0.0301, -0.0360, 0.0294),
         (SHANK, -0.0234, -0.0563, 0.0343)],
    ),
    "biceps_femoris_short": (  # bifemsh
        804.0, 0.173, 0.089, 23.0,
        [(THIGH, 0.0050, -0.2111, 0.0234), (SHANK, -0.0301, -0.0360, 0.0294),
         (SHANK, -0.0234, -0.0563, 0.0343)],
    ),
    "rectus_femoris": (  # rect_fem
        1169.0, 0.114, 0.310, 5.0,
        [(PELVIS, -0.0295, -0.0311, 0.0968),
         em.ConditionalPathPoint(
             [0.0334, -0.4030, 0.0019], THIGH, coordinate="knee", range=(-2.61799, -1.45997)),
         _moving(RECTUS_END, 0.0014)],
    ),
    "vasti": (  # vas_int, vas_lat, vas_med
        4530.0, 0.087, 0.136, 3.0,
        [(THIGH, 0.0290, -0.1924, 0.0310), (THIGH, 0.0335, -0.2084, 0.0285),
         em.ConditionalPathPoint(
             [0.0343, -0.4030, 0.0055], THIGH, coordinate="knee", range=(-2.61799, -1.42)),
         _moving(VASTI_END, 0.0018)],
    ),
    "gastrocnemius": (  # med_gas, lat_gas
        2241.0, 0.060, 0.390, 17.0,
        [(THIGH, -0.0190, -0.3929, -0.0235),
         em.ConditionalPathPoint(
             [-0.0300, -0.4022, -0.0258], THIGH, coordinate="knee", range=(-0.785398, 0.174533)),
         (FOOT, 0.0, 0.0310, -0.0053)],
    ),
    "soleus": (  # soleus
        3549.0, 0.050, 0.250, 25.0,
        [(SHANK, -0.0024, -0.1533, 0.0071), (FOOT, 0.0, 0.0310, -0.0053)],
    ),
    "tibialis_posterior": (  # tib_post
        1588.0, 0.031, 0.310, 12.0,
        [(SHANK, -0.0094, -0.1348, 0.0019), (SHANK, -0.0144, -0.4051, -0.0229),
         (FOOT, 0.0417, 0.0334, -0.0286), (FOOT, 0.0772, 0.0159, -0.0281)],
    ),
    "tibialis_anterior": (  # tib_ant
        905.0, 0.098, 0.223, 5.0,
        [(SHANK, 0.0179, -0.1624, 0.0115), (SHANK, 0.0329, -0.3951, -0.0177),
         (FOOT, 0.1166, 0.0178, -0.0305)],
    ),
    "extensor_digitorum": (  # ext_dig, per_tert
        692.0, 0.102, 0.282, 8.0,
        [(SHANK, 0.0032, -0.1381, 0.0276), (SHANK, 0.0289, -0.4007, 0.0072),
         (FOOT, 0.0922, 0.0388, -0.0001), (FOOT, 0.1616, 0.0055, 0.0130)],
    ),
    "peroneus_longus": (  # per_long, per_brev
        1378.0, 0.049, 0.345, 10.0,
        [(SHANK, 0.0005, -0.1568, 0.0362), (SHANK, -0.0207, -0.4205, 0.0286),
         (SHANK, -0.0162, -0.4319, 0.0289), (FOOT, 0.0438, 0.0230, 0.0221),
         (FOOT, 0.0681, 0.0106, 0.0284), (FOOT, 0.0852, 0.0068, 0.0118),
         (FOOT, 0.1203, 0.0085, -0.0184)],
    ),
}  # fmt: skip

# Rajagopal et al.
CONDYLES = em.WrapCylinder(
    0.0425, 0.10, position=[-0.002, -0.0205, 0.0], rotation=[0.0, -0.2, 0.0], link=SHANK, side="-x"
)
WRAPS = {"medial_hamstrings": [CONDYLES]}


def _frame(axis: tuple[float, float, float]) -> np.ndarray:
    """A rotation matrix whose z is the axis of a joint."""
    z = np.array(axis) / np.linalg.norm(axis)
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


UPRIGHT, TALUS_FRAME, FOOT_FRAME = np.eye(3), _frame(ANKLE_AXIS), _frame(SUBTALAR_AXIS)
ORIGIN = (0.0, 0.0, 0.0)


def build() -> em.MusculoskeletalModel:
    """The model: coordinates hip_flexion, hip_adduction, hip_rotation, knee, ankle, subtalar."""
    SC = exu.SystemContainer()
    mbs = SC.AddSystem()
    kind = exu.JointType
    joints = [  # one per coordinate: type, place and frame in the link before
        (kind.RevoluteZ, HIP, UPRIGHT),
        (kind.RevoluteX, ORIGIN, UPRIGHT),
        (kind.RevoluteY, ORIGIN, UPRIGHT),
        (kind.PrismaticX, ORIGIN, UPRIGHT),
        (kind.PrismaticY, ORIGIN, UPRIGHT),
        (kind.RevoluteZ, ORIGIN, UPRIGHT),
        (kind.RevoluteZ, ANKLE, TALUS_FRAME),
        (kind.RevoluteZ, TALUS_FRAME.T @ SUBTALAR, TALUS_FRAME.T @ FOOT_FRAME),
    ]
    links = [
        TreeLink(
            jointType=joint,
            parent=link - 1,
            jointHT=HomogeneousTransformation(frame, place),
            linkInertia=_inertia(link),
        )
        for link, (joint, place, frame) in enumerate(joints)
    ]
    tree = mbs.CreateKinematicTree(
        listOfTreeLinks=links,
        gravity=[0.0, -9.81, 0.0],
        baseGraphicsDataList=[],  # else Exudyn draws a pedestal
    )
    mbs.Assemble()
    muscles = [
        em.Muscle(
            name,
            max_isometric_force=strength,
            optimal_fiber_length=fiber,
            tendon_slack_length=tendon,
            pennation_angle_at_optimal=np.radians(pennation),
            max_contraction_velocity=10.0,
            path=[_point(*point) if isinstance(point, tuple) else point for point in path],
            wraps=WRAPS.get(name, ()),
        )
        for name, (strength, fiber, tendon, pennation, path) in MUSCLES.items()
    ]
    dependent = [
        em.DependentCoordinate("knee_x", of="knee", function=em.simm_spline(*KNEE_X)),
        em.DependentCoordinate("knee_y", of="knee", function=em.simm_spline(*KNEE_Y)),
    ]
    return em.MusculoskeletalModel(
        mbs, tree, muscles, coordinates=COORDINATES, dependent_coordinates=dependent
    )


def motion() -> em.Motion:
    """A step forward in 0.45 s, the knee bent by up to 64 deg, and partly back."""
    return em.Motion.from_waypoints(
        [0.0, 0.2, 0.45, 0.7, 1.0],
        np.radians(
            [  # hip flexion, adduction, rotation, knee, ankle, subtalar
                [-5.0, -2.0, 0.0, -40.0, -18.0, 0.0],
                [12.0, -5.0, 4.0, -63.0, -6.0, 5.0],
                [28.0, -3.0, -2.0, -15.0, 4.0, 0.0],
                [20.0, 2.0, -4.0, -22.0, -2.0, -4.0],
                [5.0, 3.0, 0.0, -10.0, -8.0, 0.0],
            ]
        ),
    )  # fmt: skip


def _point(segment: int | None, x: float, y: float, z: float) -> em.PathPoint:
    """A point given in its segment's upright frame."""
    if segment is PELVIS:
        return em.PathPoint([x, y, z])
    return em.PathPoint(FOOT_FRAME.T @ [x, y, z] if segment == FOOT else [x, y, z], link=segment)


def _inertia(link: int) -> RigidBodyInertia:
    """Of a segment, in the frame of its link; the links between have none."""
    if link not in SEGMENTS:
        return RigidBodyInertia(mass=0.0, inertiaTensor=np.zeros((3, 3)))
    fraction, length, com, radii = SEGMENTS[link]
    frame = FOOT_FRAME if link == FOOT else UPRIGHT
    mass = fraction * BODY_MASS
    tensor = mass * np.diag(np.square(radii)) * length**2
    return RigidBodyInertia(
        mass=mass,
        inertiaTensor=frame.T @ tensor @ frame,
        com=frame.T @ np.array(com) * length,
        inertiaTensorAtCOM=True,
    )
