"""Small files of OpenSim, written for one test, and where a loaded model's bodies are."""

import numpy as np
from scipy.spatial.transform import Rotation

import exudyn_muscles as em
from exudyn_muscles.opensim.bodies import Bodies
from exudyn_muscles.opensim.document import read_document
from exudyn_muscles.skeleton.tree import tree_frames

BODY = """
<Body name="{name}"><mass>2.5</mass><mass_center>0.1 -0.2 0.05</mass_center>
<inertia>0.04 0.05 0.06 0.003 -0.002 0.001</inertia>{inside}</Body>"""
JOINT = """
<{kind} name="joint"><socket_parent_frame>before</socket_parent_frame>
<socket_child_frame>behind</socket_child_frame><coordinates>{coordinates}</coordinates><frames>
<PhysicalOffsetFrame name="before"><socket_parent>/ground</socket_parent>
<translation>0.1 0.2 0.3</translation><orientation>0.4 -0.5 0.6</orientation></PhysicalOffsetFrame>
<PhysicalOffsetFrame name="behind"><socket_parent>/bodyset/body</socket_parent>
<translation>-0.2 0.1 0.05</translation><orientation>-0.3 0.2 0.7</orientation>
</PhysicalOffsetFrame></frames>{inside}</{kind}>"""
MUSCLE = """
<{kind} name="muscle"><GeometryPath><PathPointSet><objects>{points}</objects></PathPointSet>
<PathWrapSet><objects>{wraps}</objects></PathWrapSet></GeometryPath>{inside}</{kind}>"""
GROUND_POINT = """<PathPoint name="a"><socket_parent_frame>/ground</socket_parent_frame>
<location>0.5 0.1 0</location></PathPoint>"""
BODY_POINT = """<PathPoint name="b"><socket_parent_frame>/bodyset/body</socket_parent_frame>
<location>0 0.1 0.2</location></PathPoint>"""
DOCUMENT = """<?xml version="1.0"?>
<OpenSimDocument Version="{version}"><Model name="model">{ground}
<BodySet><objects>{bodies}</objects></BodySet><JointSet><objects>{joints}</objects></JointSet>
<ForceSet><objects>{forces}</objects></ForceSet>{rest}</Model></OpenSimDocument>"""


def coordinates(*names, inside=""):
    return "".join(f'<Coordinate name="{name}">{inside}</Coordinate>' for name in names)


def joint(kind, names, inside=""):
    return JOINT.format(kind=kind, coordinates=coordinates(*names), inside=inside)


def muscle(kind="Thelen2003Muscle", points=GROUND_POINT + BODY_POINT, wraps="", inside=""):
    return MUSCLE.format(kind=kind, points=points, wraps=wraps, inside=inside)


PIN = joint("PinJoint", ["angle"])
LOCKED = "<default_value>0.3</default_value><locked>true</locked>"


def write_model(file, **changes):
    """Write a model of one body, changed here and there; return its file."""
    parts = {
        "version": 40000, "ground": "", "bodies": BODY.format(name="body", inside=""),
        "joints": PIN, "forces": muscle(), "rest": "",
    }  # fmt: skip
    file.write_text(DOCUMENT.format(**parts | changes))
    return file


class Loaded:
    """A file as a model, with the poses of its bodies."""

    def __init__(self, file):
        self.model = em.opensim.load_model(file)
        self.places = Bodies(read_document(file)).places

    def pose(self, q, body):
        """Rotation (3, 3) and position (3,) of a body."""
        of_tree = self.model.state_of_tree(np.asarray(q, dtype=float))[0]
        R, p, _ = tree_frames(self.model.skeleton.tree, of_tree)
        link, H = self.places[f"/bodyset/{body}"]
        if link < 0:
            return H[:3, :3], H[:3, 3]
        return R[link] @ H[:3, :3], p[link] + R[link] @ H[:3, 3]

    def dynamics(self, q, v):
        """M (n, n) and H - Q (n,)."""
        skeleton = self.model.skeleton
        with skeleton.opened():
            return skeleton.dynamics_at(np.asarray(q, float), np.asarray(v, float), 0.0)[:2]


def frame(angles, position):
    H = np.eye(4)
    H[:3, :3], H[:3, 3] = Rotation.from_euler("XYZ", angles).as_matrix(), position
    return H


def about(axis, angle):
    H = np.eye(4)
    H[:3, :3] = Rotation.from_rotvec(angle * np.asarray(axis) / np.linalg.norm(axis)).as_matrix()
    return H


def along(*position):
    return frame(np.zeros(3), position)
