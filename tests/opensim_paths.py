"""The paths of OpenSim models on trees of their own: chains of joints, without Exudyn.

A joint is up to six links with one joint each, whose coordinates are functions of the model's, as
in a knee that slides while it turns.
"""

import xml.etree.ElementTree as ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

import exudyn_muscles as em
from exudyn_muscles.skeleton.geometry import compile_geometry, path_points
from exudyn_muscles.skeleton.tree import Tree

from .opensim import REFERENCE
from .opensim_files import frame
from .opensim_models import FILES, vector
from .path.trees import paths_of

REVOLUTE_Z, PRISMATIC_Z = 2, 5
UNIT = {"max_isometric_force": 1.0, "optimal_fiber_length": 0.1, "tendon_slack_length": 0.1}


def scaled(element):
    """The innermost function of an element, and what it is multiplied by."""
    factor = 1.0
    while element.tag == "MultiplierFunction":
        factor *= float(element.findtext("scale"))
        element = element.find("function")[0]
    return element, factor


def curve(element):
    """A function of a file: a number or a curve."""
    element, factor = scaled(element)
    if element.tag == "Constant":
        return factor * float(element.findtext("value"))
    if element.tag == "LinearFunction":
        slope, value = factor * vector(element.findtext("coefficients"))
        return em.Curve(lambda x: value + slope * x, [-1.0, 1.0])
    assert element.tag == "SimmSpline"
    return em.simm_spline(vector(element.findtext("x")), factor * vector(element.findtext("y")))


class OpenSimPaths:
    """The paths of a model.

    Attributes
    ----------
    tree : Tree
    paths : Paths
    """

    def __init__(self, name, coordinates):
        self.root = ElementTree.parse(REFERENCE.parent / "models" / FILES[name]).getroot()
        self.coordinates = list(coordinates)
        self.joints, self.parents, self.frames, self.drives = [], [], [], []
        self.bodies = {"/ground": (-1, np.eye(4))}  # link, and the body's frame in the link's
        for joint in self.root.find("Model/JointSet/objects"):
            self.add_joint(joint)
        self.tree = Tree(
            joints=np.array(self.joints),
            parents=np.array(self.parents),
            rotations=np.array([H[:3, :3] for H in self.frames]),
            offsets=np.array([H[:3, 3] for H in self.frames]),
            base=np.zeros(3),
            reference=np.zeros(len(self.joints)),
        )
        self.surfaces = {
            item.get("name"): self.surface(item, f"/bodyset/{body.get('name')}")
            for body in self.root.find("Model/BodySet/objects")
            for item in body.find("WrapObjectSet/objects")
        }
        self.muscles = em.MuscleSet(
            self.muscle(item)
            for item in self.root.find("Model/ForceSet/objects")
            if item.find("GeometryPath") is not None
        )
        self.paths = paths_of(self.muscles, len(self.tree))
        self.geometry = compile_geometry(self.tree, self.paths, self.muscles.names)

    def add_joint(self, joint):
        frames = {}
        for item in joint.find("frames"):
            H = frame(vector(item.findtext("orientation")), vector(item.findtext("translation")))
            frames[item.get("name")] = item.findtext("socket_parent"), H
        parent, H = frames[joint.findtext("socket_parent_frame")]
        child, H_child = frames[joint.findtext("socket_child_frame")]
        link, H_parent = self.bodies[parent]
        H = H_parent @ H
        axes = {item.get("name"): item for item in joint.iter("TransformAxis")}
        order = [f"translation{k}" for k in (1, 2, 3)] + [f"rotation{k}" for k in (1, 2, 3)]
        turned = False
        for name in order if axes else []:
            item = axes[name]
            axis = vector(item.findtext("axis"))
            axis /= np.linalg.norm(axis)
            function = curve(next(x for x in item if x.tag not in ("coordinates", "axis")))
            if name.startswith("translation"):
                kind, fixed = PRISMATIC_Z, lambda s, a=axis: frame(np.zeros(3), s * a)
            else:
                kind = REVOLUTE_Z
                turned = True

                def fixed(s, a=axis):
                    G = np.eye(4)
                    G[:3, :3] = Rotation.from_rotvec(s * a).as_matrix()
                    return G

            if not isinstance(function, em.Curve):
                H = H @ fixed(function)
                continue
            A = np.eye(4)
            A[:3, :3] = Rotation.align_vectors([axis], [[0.0, 0.0, 1.0]])[0].as_matrix()
            self.joints.append(kind)
            self.parents.append(link)
            self.frames.append(H @ A)
            self.drives.append((self.coordinates.index(item.findtext("coordinates")), function))
            link, H = len(self.joints) - 1, A.T
        assert turned or not axes
        self.bodies[child] = link, H @ np.linalg.inv(H_child)

    def on_link(self, body, position):
        link, H = self.bodies[body]
        return link, H[:3, :3] @ position + H[:3, 3]

    def follows(self, path):
        """The number of the turning link that has a coordinate's own value."""
        wanted = self.coordinates.index(path.split("/")[-1])
        return max(k for k, (number, _) in enumerate(self.drives) if number == wanted)

    def point(self, item):
        body = item.findtext("socket_parent_frame")
        if item.tag == "MovingPathPoint":
            link, H = self.bodies[body]
            np.testing.assert_array_equal(H, np.eye(4))
            x, y, z = (curve(item.find(f"{name}_location")[0]) for name in "xyz")
            coordinate = self.follows(item.findtext("socket_x_coordinate"))
            return em.MovingPathPoint(x, y, z, link, coordinate=coordinate)
        link, position = self.on_link(body, vector(item.findtext("location")))
        if item.tag == "PathPoint":
            return em.PathPoint(position, link)
        assert item.tag == "ConditionalPathPoint"
        coordinate = self.follows(item.findtext("socket_coordinate"))
        return em.ConditionalPathPoint(
            position, link, coordinate=coordinate, range=vector(item.findtext("range"))
        )

    def surface(self, item, body):
        given = frame(
            vector(item.findtext("xyz_body_rotation")), vector(item.findtext("translation"))
        )
        link, H = self.bodies[body]
        H = H @ given
        quadrant = item.findtext("quadrant").strip().lstrip("+")
        place = {
            "link": link,
            "position": H[:3, 3],
            "rotation": Rotation.from_matrix(H[:3, :3]).as_euler("XYZ"),
            "side": None if quadrant == "all" else quadrant,
            "active": item.findtext("active").strip() == "true",
            "name": item.get("name"),
        }
        if item.tag == "WrapCylinder":
            radius, length = (float(item.findtext(key)) for key in ("radius", "length"))
            return em.WrapCylinder(radius, length, **place)
        assert item.tag == "WrapEllipsoid"
        return em.WrapEllipsoid(vector(item.findtext("dimensions")), **place)

    def muscle(self, item):
        path = item.find("GeometryPath")
        wraps = []
        for wrap in path.find("PathWrapSet/objects"):
            first, last = (int(number) for number in vector(wrap.findtext("range")))
            surface = self.surfaces[wrap.findtext("wrap_object").strip()]
            # From 1, and -1 for both ends.
            wraps.append(em.PathWrap(surface, max(first - 1, 0), last - 1 if last > 0 else -1))
        points = [self.point(point) for point in path.find("PathPointSet/objects")]
        return em.Muscle(item.get("name"), **UNIT, path=points, wraps=wraps)

    def links(self, z):
        """The links' coordinates at the model's, and their derivatives."""
        q, slopes = np.empty(len(self.tree)), np.zeros((len(self.tree), len(z)))
        for k, (number, function) in enumerate(self.drives):
            q[k], slopes[k, number] = function(z[number]), function.derivative(z[number])
        return q, slopes

    def evaluate(self, z, speeds):
        """l, l' (m,) and r (m, nz) in the model's own coordinates."""
        q, slopes = self.links(z)
        l, l_t, r, _ = self.geometry(q, slopes @ speeds)
        return l, l_t, r @ slopes

    def points(self, z):
        return path_points(self.tree, self.paths, self.links(z)[0])
