"""A leg of OpenSim whose knee and patella slide along splines, in Exudyn: its equations of motion.

One tree coordinate for every axis of a joint, most of them dependent; the patella's own coordinate
is coupled to the knee.
"""

import json

import exudyn as exu
import numpy as np
from exudyn.utilities import HomogeneousTransformation, RigidBodyInertia, TreeLink

import exudyn_muscles as em

from ..opensim import REFERENCE, needs_opensim_files
from ..opensim_models import vector
from ..opensim_paths import OpenSimPaths, curve
from ..path.trees import JOINTS

pytestmark = needs_opensim_files


def link_inertias(source):
    """Of every link, from the bodies on it."""
    links = [RigidBodyInertia(mass=0.0, inertiaTensor=np.zeros((3, 3))) for _ in source.drives]
    for body in source.root.find("Model/BodySet/objects"):
        link, H = source.bodies[f"/bodyset/{body.get('name')}"]
        xx, yy, zz, xy, xz, yz = vector(body.findtext("inertia"))
        R, com = H[:3, :3], vector(body.findtext("mass_center"))
        inertia = RigidBodyInertia(
            mass=float(body.findtext("mass")),
            inertiaTensor=R @ [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]] @ R.T,
            com=R @ com + H[:3, 3],
            inertiaTensorAtCOM=True,
        )
        links[link] = inertia if links[link].mass == 0.0 else links[link] + inertia
    return links


def build(coupled):
    """The model, OpenSim's names of its coordinates, and its reference numbers."""
    numbers = np.load(REFERENCE / "leg6dof9musc_static.npz")
    facts = json.loads((REFERENCE / "leg6dof9musc_static.json").read_text())
    source = OpenSimPaths("leg6dof9musc", facts["coordinates"])
    links = [
        (JOINTS[joint], parent, HomogeneousTransformation(H[:3, :3], H[:3, 3]), inertia)
        for joint, parent, H, inertia in zip(
            source.tree.joints, source.parents, source.frames, link_inertias(source), strict=True
        )
    ]
    names, dependents = [], []
    for k, (number, function) in enumerate(source.drives):
        coordinate = source.coordinates[number]
        x = np.array([-1.0, 0.5, 1.0])
        if coordinate not in names and np.allclose(function(x), x, rtol=0, atol=1e-12):
            names.append(coordinate)
        else:
            names.append(f"{coordinate}, link {k}")
            dependents.append(em.DependentCoordinate(names[-1], of=coordinate, function=function))
    for coordinate in sorted(set(source.coordinates) - set(names)):
        # No axis has its value: a point on a hinge of its own, which adds nothing to M.
        point = RigidBodyInertia(mass=1.0, inertiaTensor=np.zeros((3, 3)))
        links.append((exu.JointType.RevoluteZ, -1, np.eye(4), point))
        names.append(coordinate)
    if coupled:
        coupler = source.root.find("Model/ConstraintSet/objects/CoordinateCouplerConstraint")
        function = curve(coupler.find("coupled_coordinates_function")[0])
        of = coupler.findtext("independent_coordinate_names").strip()
        dependent = coupler.findtext("dependent_coordinate_name").strip()
        dependents.append(em.DependentCoordinate(dependent, of=of, function=function))
    mbs = exu.SystemContainer().AddSystem()
    tree = mbs.CreateKinematicTree(
        listOfTreeLinks=[
            TreeLink(jointType=joint, parent=parent, jointHT=H, linkInertia=inertia)
            for joint, parent, H, inertia in links
        ],
        gravity=facts["gravity"],
    )
    mbs.Assemble()
    model = em.MusculoskeletalModel(
        mbs, tree, source.muscles, coordinates=names, dependent_coordinates=dependents
    )
    return model, source, numbers


def rows(model, source, *arrays):
    """Rows of OpenSim's numbers in the order of the model's coordinates."""
    order = [source.coordinates.index(name) for name in model.coordinates]
    return zip(*(array[:, order] for array in arrays), strict=True)


def test_the_equations_of_motion():
    model, source, numbers = build(coupled=False)
    assert len(model.coordinates) == 7 and len(model.skeleton.tree) == 12
    with model.skeleton.opened():
        order = [source.coordinates.index(name) for name in model.coordinates]
        masses = numbers["M"][:, order][:, :, order]
        forces = numbers["tau_coriolis"] - numbers["tau_gravity"]
        for (q, v, bias), M in zip(
            rows(model, source, numbers["q"], numbers["u"], forces), masses, strict=True
        ):
            mine = model.skeleton.dynamics_at(q, v, 0.0)[:2]
            np.testing.assert_allclose(mine[0], M, rtol=0, atol=1e-10)
            np.testing.assert_allclose(mine[1], bias, rtol=0, atol=1e-10)


def test_free_accelerations_with_the_coupler():
    """OpenSim enforces it by a constraint."""
    model, source, numbers = build(coupled=True)
    assert len(model.coordinates) == 6 and "knee_angle_pat_r" not in model.coordinates
    with model.skeleton.opened():
        for q, v, a in rows(model, source, numbers["q"], numbers["u"], numbers["udot_passive"]):
            M, bias = model.skeleton.dynamics_at(q, v, 0.0)[:2]
            np.testing.assert_allclose(np.linalg.solve(M, -bias), a, rtol=1e-9, atol=1e-9)


def test_moment_arms_with_the_coupler():
    """Those of knee and patella add up."""
    model, source, numbers = build(coupled=True)
    for q, v in zip(numbers["q"], numbers["u"], strict=True):
        length, speed, r = source.evaluate(q, v)
        order = [source.coordinates.index(name) for name in model.coordinates]
        mine = model.geometry(q[order], v[order])
        np.testing.assert_allclose(mine.length, length, rtol=0, atol=1e-12)
        np.testing.assert_allclose(mine.lengthening_speed, speed, rtol=0, atol=1e-11)
        knee, patella = (source.coordinates.index(f"knee_angle_{x}r") for x in ("", "pat_"))
        r[:, knee] += r[:, patella]
        np.testing.assert_allclose(mine.moment_arms, r[:, order], rtol=0, atol=1e-12)
