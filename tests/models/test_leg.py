"""The leg: segments against their source, moment arms against measured ones, the step."""

import dataclasses

import numpy as np
import pytest
from scipy.optimize import linprog

import exudyn_muscles as em
from models import leg

from ..runs import KP

REST = np.zeros(6)
HIP_FLEXION, HIP_ADDUCTION, HIP_ROTATION, KNEE, ANKLE, SUBTALAR = range(6)

# What every muscle is for, in any anatomy: 1 for flexion, adduction, internal rotation at the hip,
# extension of the knee, dorsiflexion, inversion; here D. A. Neumann, "Kinesiology of the hip",
# J. Orthop. Sports Phys. Ther. 40 (2010) 82-94, and for the foot B. Hintermann, B. M. Nigg, C.
# Sommer, "Foot movement and tendon excursion", Foot Ankle Int. 15 (1994) 386-395.
ACTIONS = {
    "gluteus_maximus": {HIP_FLEXION: -1, HIP_ROTATION: -1},
    "gluteus_medius_anterior": {HIP_ADDUCTION: -1, HIP_ROTATION: 1},
    "gluteus_medius_posterior": {HIP_ADDUCTION: -1},
    "iliopsoas": {HIP_FLEXION: 1},
    "adductor_longus": {HIP_FLEXION: 1, HIP_ADDUCTION: 1},
    "adductor_magnus": {HIP_ADDUCTION: 1},
    "tensor_fasciae_latae": {HIP_FLEXION: 1, HIP_ADDUCTION: -1},
    "piriformis": {HIP_ADDUCTION: -1, HIP_ROTATION: -1},
    "medial_hamstrings": {HIP_FLEXION: -1, KNEE: -1},
    "biceps_femoris_long": {HIP_FLEXION: -1, KNEE: -1},
    "biceps_femoris_short": {KNEE: -1},
    "rectus_femoris": {HIP_FLEXION: 1, KNEE: 1},
    "vasti": {KNEE: 1},
    "gastrocnemius": {KNEE: -1, ANKLE: -1},
    "soleus": {ANKLE: -1, SUBTALAR: 1},
    "tibialis_posterior": {ANKLE: -1, SUBTALAR: 1},
    "tibialis_anterior": {ANKLE: 1, SUBTALAR: 1},
    "extensor_digitorum": {ANKLE: 1, SUBTALAR: -1},
    "peroneus_longus": {ANKLE: -1, SUBTALAR: -1},
}


@pytest.fixture(scope="module")
def model():
    return leg.build()


@pytest.fixture(scope="module")
def static(model):
    return em.static_optimization(model, leg.motion())


@pytest.fixture(scope="module")
def cmc():
    return em.computed_muscle_control(leg.build(), leg.motion(), settings=em.CMCSettings(kp=KP))


def arm(model, muscle, coordinate, **degrees):
    """In mm, at upright standing but for some coordinates."""
    q = np.radians([degrees.get(name, 0.0) for name in model.coordinates])
    i = model.muscles.names.index(muscle)
    return 1e3 * model.geometry(q, REST).moment_arms[i, coordinate]


def test_segments_are_those_of_a_man_of_75_kg(model):
    """De Leva (1996), table 4, men; joints at upright standing from Delp et al. (1990)."""
    hip_to_knee, knee_to_ankle, foot_length = 0.396, 0.43, 0.152 * 1.80
    knee = np.array([-0.0048, -hip_to_knee, 0.0])
    heel = knee + np.array([-0.04877, -knee_to_ankle - 0.04195, 0.00792])
    mass = 0.75 * np.array([14.16, 4.33, 1.37])
    com = np.array(
        [
            [0.0, -0.4095 * hip_to_knee, 0.0],
            knee - np.array([0.0, 0.4395 * knee_to_ankle, 0.0]),
            heel + np.array([0.4415 * foot_length, 0.0, 0.0]),
        ]
    )
    radii = np.array(
        [
            np.array([32.9, 14.9, 32.9]) * hip_to_knee,
            np.array([25.1, 10.2, 24.6]) * knee_to_ankle,
            np.array([12.4, 25.7, 24.5]) * foot_length,
        ]
    )
    square = (0.01 * radii) ** 2 + (com**2).sum(axis=1, keepdims=True) - com**2
    inertia = mass @ square  # about the hip's x, y and z
    bent = np.array([np.pi / 2, 0.0, 0.0, 0.0, 0.0, 0.0])
    with model.skeleton.opened():
        M, standing = model.skeleton.dynamics_at(REST, REST, 0.0)[:2]
        _, raised = model.skeleton.dynamics_at(bent, REST, 0.0)[:2]
    about = [HIP_ADDUCTION, HIP_ROTATION, HIP_FLEXION]
    np.testing.assert_allclose(M[about, about], inertia, rtol=1e-3)
    np.testing.assert_allclose(raised[HIP_FLEXION], -9.81 * mass @ com[:, 1], rtol=1e-3)
    np.testing.assert_allclose(standing[HIP_FLEXION], 9.81 * mass @ com[:, 0], rtol=0, atol=0.005)
    assert sum(model.mbs.GetObject(model.skeleton.object)["linkMasses"]) == pytest.approx(14.895)


def test_every_muscle_does_what_it_is_for_in_the_whole_motion(model, static):
    assert set(ACTIONS) == set(model.muscles.names)
    r = np.array([model.geometry(q, REST).moment_arms for q in static.coordinates])
    for name, actions in ACTIONS.items():
        for coordinate, sign in actions.items():
            arms = sign * r[:, model.muscles.names.index(name), coordinate]
            assert arms.min() > 1e-3, (name, model.coordinates[coordinate])


@pytest.mark.parametrize("knee", [-110.0, -90.0, -60.0, -30.0, 0.0])
def test_no_muscle_slips_to_the_other_side_of_the_bent_knee(model, knee):
    for name, actions in ACTIONS.items():
        if KNEE in actions:
            assert actions[KNEE] * arm(model, name, KNEE, knee=knee) > 1.0, name


# Measured moment arms [mm].


@pytest.mark.parametrize("ankle", [-30.0, -15.0, 0.0])
def test_achilles_tendon(model, ankle):
    """C. N. Maganaris, V. Baltzopoulos, A. J. Sargeant, Eur. J. Appl. Physiol. 83 (2000) 363-369:
    43 to 56 at rest."""
    assert 43.0 < -arm(model, "soleus", ANKLE, ankle=ankle) < 56.0


def test_tibialis_anterior(model):
    """C. N. Maganaris, J. Biomech. 33 (2000) 375-379: from 45 in dorsiflexion to 29 at rest."""
    arms = [arm(model, "tibialis_anterior", ANKLE, ankle=ankle) for ankle in (-30, -15, 0, 15)]
    assert (np.diff(arms) > 0.0).all() and arms[0] > 29.0 and arms[-1] < 45.0


def test_quadriceps(model):
    """H. S. Im, O. Goltzer, F. T. Sheehan, J. Biomech. 48 (2015) 3737-3742: from 31.5 at 50 deg to
    47.1 at 10 deg of flexion, men."""
    arms = [arm(model, "vasti", KNEE, knee=knee) for knee in (-50, -40, -30, -20, -10)]
    assert arms[0] < arms[-1] and min(arms) > 31.5 and max(arms) < 47.1


def test_invertors_of_the_foot(model):
    """Hintermann, Nigg and Sommer (1994): tibialis anterior 0.59 and soleus 0.24 of the tibialis
    posterior, the extensor of the toes turns outwards, the peroneus longus more so."""
    posterior, anterior, soleus, toes, peroneus = (
        arm(model, name, SUBTALAR)
        for name in (
            "tibialis_posterior", "tibialis_anterior", "soleus", "extensor_digitorum",
            "peroneus_longus",
        )
    )  # fmt: skip
    assert anterior / posterior == pytest.approx(0.59, abs=0.1)
    assert soleus / posterior == pytest.approx(0.24, abs=0.02)
    assert peroneus < toes < 0.0


@pytest.mark.parametrize("name", [*list(ACTIONS)[:3], "piriformis"])
def test_flexion_of_the_hip_makes_internal_rotators(model, name):
    """S. L. Delp, W. E. Hess, D. S. Hungerford, L. C. Jones, J. Biomech. 32 (1999) 493-501."""
    arms = [arm(model, name, HIP_ROTATION, hip_flexion=hip) for hip in (0, 20, 45, 60, 90)]
    assert (np.diff(arms) > 0.0).all()


@pytest.mark.parametrize(
    ("name", "coordinate", "threshold"),
    [
        ("iliopsoas", HIP_FLEXION, 0.785398),
        ("rectus_femoris", KNEE, -1.45997),
        ("vasti", KNEE, -1.42),
        ("gastrocnemius", KNEE, -0.785398),
    ],
)
def test_lengths_hardly_jump_where_points_come_and_go(model, name, coordinate, threshold):
    i = model.muscles.names.index(name)
    q = np.zeros((2, 6))
    q[:, coordinate] = threshold + np.array([-2e-5, 2e-5])
    before, after = (model.geometry(one, REST).length[i] for one in q)
    assert abs(after - before) < 0.6e-3


@pytest.mark.parametrize("knee", [-100.0, -60.0, -30.0, -15.0, 0.0])
def test_the_cylinder_does_what_the_published_point_does(model, knee):
    """Semitendinosus of Delp et al. (1990), with a point that comes and goes at 19 deg."""
    published = em.ConditionalPathPoint(
        [-0.04203, -0.02859, -0.02277], leg.SHANK, coordinate="knee", range=(-0.331613, 0.174533)
    )
    muscle = next(one for one in model.muscles if one.name == "medial_hamstrings")
    start, *rest = muscle.path
    other = em.MusculoskeletalModel(
        model.mbs,
        model.skeleton.object,
        [dataclasses.replace(muscle, path=[start, published, *rest], wraps=())],
        coordinates=leg.COORDINATES,
        dependent_coordinates=model.dependent_coordinates,
    )
    arms = (arm(one, "medial_hamstrings", KNEE, knee=knee) for one in (model, other))
    assert abs(np.subtract(*arms)) < 2.5


# The step.


def test_the_muscles_could_turn_every_joint_either_way(model, static):
    """With all other torques as demanded, isometric forces leave 10 N m both ways."""
    muscles = model.muscles
    for k in range(0, 101, 10):
        l = static.musculotendon_lengths[k]
        r = model.geometry(static.coordinates[k], REST).moment_arms
        low, high = (
            em.equilibrium(muscles, a, l).force
            for a in (muscles.minimum_activation, np.ones(len(muscles)))
        )
        demand = static.torques_delivered[k]
        for j in range(6):
            others = np.arange(6) != j
            for way in (1.0, -1.0):
                best = linprog(
                    -way * r[:, j], A_eq=r[:, others].T, b_eq=demand[others],
                    bounds=np.column_stack([low, high]),
                )  # fmt: skip
                assert best.success and -best.fun - way * demand[j] > 10.0


@pytest.mark.parametrize("scheme", list(em.Scheme))
def test_cosimulation_tracks(scheme):
    settings = em.CosimulationSettings(kp=KP, scheme=scheme)
    result = em.cosimulate(leg.build(), leg.motion(), settings=settings)
    assert result.status is em.Status.COMPLETE and result.max_unmet_torque == 0.0
    assert np.degrees(result.tracking_error_rms()).max() < 0.15
    assert 0.3 < result.excitation_values.max() < 0.8


def test_cmc_tracks_and_its_excitations_replay(static, cmc):
    assert static.max_unmet_torque == cmc.max_unmet_torque == 0.0
    assert np.degrees(cmc.tracking_error_rms()).max() < 0.012
    replay = em.forward_dynamics(leg.build(), cmc.excitations)
    assert np.abs(replay.coordinates - cmc.coordinates).max() < 1e-9


def test_fibers_stay_between_half_and_one_and_a_half_optimal_lengths(model, cmc):
    lengths = cmc.fiber_lengths / model.muscles.optimal_fiber_length
    assert lengths.min() > 0.5 and lengths.max() < 1.5


def test_forces_are_of_the_size_of_those_of_walking(cmc):
    """A leg that swings needs its flexors at the hip, and hardly anything at the foot."""
    peak = dict(zip(cmc.muscle_names, cmc.tendon_forces.max(axis=0), strict=True))
    assert max(peak, key=peak.get) == "iliopsoas" and 500.0 < peak["iliopsoas"] < 1500.0
    assert peak["soleus"] < 150.0
