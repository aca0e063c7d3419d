"""Closed loops of a tree that Exudyn's user builds: a four-bar linkage, and what is wrong in them.

Against OpenSim's constraints they are in `tests/opensim/test_loops.py`.
"""

import exudyn as exu
import numpy as np
import pytest
from exudyn.utilities import HomogeneousTransformation, InertiaCuboid, TreeLink

import exudyn_muscles as em
from exudyn_muscles.skeleton.tree import tree_frames

CRANK, ROD, ROCKER, BASE = 0.1, 0.3, 0.25, 0.3
NAMES = ("crank", "rod", "rocker")
POINT, DISTANCE = em.ClosureKind.POINT, em.ClosureKind.DISTANCE


def at(x, y=0.0):
    H = np.eye(4)
    H[:2, 3] = x, y
    return H


def linkage(loops):
    """Three bars in a row about z axes."""
    mbs = exu.SystemContainer().AddSystem()
    offsets, lengths = [0.0, CRANK, ROD], [CRANK, ROD, ROCKER]
    bars = [InertiaCuboid(1e3, [x, 0.03, 0.03]).Translated([x / 2, 0, 0]) for x in lengths]
    tree = mbs.CreateKinematicTree(
        listOfTreeLinks=[
            TreeLink(
                jointType=exu.JointType.RevoluteZ,
                parent=k - 1,
                jointHT=HomogeneousTransformation(np.eye(3), [offsets[k], 0.0, 0.0]),
                linkInertia=bars[k],
            )
            for k in range(3)
        ],
        initialCoordinates=[0.8, -0.6, -1.6],
        gravity=[0.0, -9.81, 0.0],
    )
    mbs.Assemble()
    size = {"max_isometric_force": 100.0, "optimal_fiber_length": 0.1, "tendon_slack_length": 0.1}
    path = [em.PathPoint([-0.15, 0.1, 0.0]), em.PathPoint([0.05, 0.01, 0.0], link=0)]
    return em.MusculoskeletalModel(
        mbs, tree, [em.Muscle("flexor", **size, path=path)], coordinates=NAMES, loops=loops
    )


PIN = em.Closure(POINT, 2, -1, at(ROCKER), at(BASE), name="pin")


def test_a_four_bar_linkage_is_closed_whatever_the_crank_does():
    """Its rocker by the law of cosines; the third equation of the pin, along z, is redundant."""
    model = linkage(em.Loops([PIN]))
    assert model.coordinates == ("crank",)
    for angle in np.linspace(-3.0, 9.0, 25):
        (q,) = model.state_of_tree([angle])
        R, p, _ = tree_frames(model.skeleton.tree, q)
        np.testing.assert_allclose(p[2] + R[2] @ [ROCKER, 0, 0], [BASE, 0, 0], atol=1e-13)
        diagonal = np.hypot(CRANK * np.cos(angle) - BASE, CRANK * np.sin(angle))
        cosine = (ROD**2 + ROCKER**2 - diagonal**2) / (2.0 * ROD * ROCKER)
        assert np.cos(np.pi - abs(q[2])) == pytest.approx(cosine, abs=1e-12)


def test_the_user_says_what_is_held_first():
    held = em.Loops([PIN], held_first=["crank", "rod"])
    assert linkage(held).coordinates == ("rocker",)


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: em.Closure("point", 0, 1), em.ParameterError, "kind is a ClosureKind, got 'poi"),
        (lambda: em.Closure(DISTANCE, 0, 1, name="rod"), em.ParameterError,
         r"closure 'rod': distance = 0\.0 is outside"),
        (lambda: em.Closure(POINT, 0, 1, np.eye(3)), em.ParameterError, r"frame_0 is a finite \(4"),
        (lambda: em.Closure(POINT, 0.5, 1), em.ParameterError, "link_0 is the number of a link"),
        (lambda: em.Loops([]), em.ParameterError, "closures are one or more Closure objects"),
        (lambda: linkage(em.Loops([em.Closure(POINT, 2, 3, name="pin")])), em.ParameterError,
         "closure 'pin' is on link 3, but the tree has links 0 to 2"),
        (lambda: linkage(em.Loops([PIN], ["wheel"])), em.ParameterError,
         "held_first: the tree has no coordinate 'wheel'"),
        (lambda: linkage([PIN]), em.ParameterError, "loops must be Loops, got"),
        (lambda: linkage(em.Loops([em.Closure(POINT, 2, -1, at(ROCKER), at(5.0))])), em.ModelError,
         "loops of the tree cannot be closed"),
        (lambda: linkage(em.Loops([PIN, em.Closure(DISTANCE, 0, -1, at(CRANK), at(BASE, 0.1),
                                                   distance=0.25)])), em.ModelError,
         "leave no coordinate that can move"),
    ],
)  # fmt: skip
def test_what_is_wrong(make, error, message):
    with pytest.raises(error, match=message):
        make()


def test_a_linkage_beyond_its_reach_says_so():
    model = linkage(em.Loops([PIN], held_first=["crank", "rod"]))
    with pytest.raises(em.ModelError, match=r"the closures of the tree's loops .*: rocker = "):
        model.state_of_tree([3.0])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"distance": 0.5}, "is of a DISTANCE alone"),
        ({"frame_0": 3.0 * np.eye(4)}, "frame_0 does not turn by a rotation"),
        ({"frame_1": np.diag([1.0, 1.0, -1.0, 1.0])}, "frame_1 does not turn by a rotation"),
    ],
)
def test_closures_that_are_none_are_named(given, message):
    with pytest.raises(em.ParameterError, match=message):
        em.Closure(**({"kind": em.ClosureKind.WELD, "link_0": 0, "link_1": 1} | given))


def test_names_in_one_text_are_no_names():
    loops = em.Closure(em.ClosureKind.POINT, 0, 1)
    with pytest.raises(em.ParameterError, match="held_first is a sequence of names"):
        em.Loops([loops], held_first="knee")
