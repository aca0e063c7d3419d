"""A flexible shank: finite elements on a floating frame of reference, with a hinge and muscles."""

from __future__ import annotations

from itertools import product

import exudyn as exu
import numpy as np
import scipy.linalg
import scipy.sparse
from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface
from exudyn.utilities import (
    GenericJoint,
    MarkerBodyRigid,
    MarkerNodeRigid,
    MarkerSuperElementRigid,
)

import exudyn_muscles as em

LENGTH, SIDE, ELEMENTS, MODES = 0.4, 0.03, 4, 4
YOUNG, POISSON, DENSITY = 5e9, 0.3, 1500.0
CORNERS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1],
     [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
)  # fmt: skip
GRAVITY = np.array([0.0, -9.81, 0.0])
ORIGINS = {"up": [-0.15, 0.12, 0.0], "down": [-0.15, -0.12, 0.0]}
INSERTION = 2  # the layer of nodes that muscles pull at
SIZE = {"max_isometric_force": 800.0, "optimal_fiber_length": 0.16, "tendon_slack_length": 0.2}


def number(i, j, k):
    """That of a node by its places along x, y, z."""
    return 4 * i + 2 * j + k


def layer(i):
    return [number(i, j, k) for j in (0, 1) for k in (0, 1)]


def element_matrices(corners):
    """K and M (24, 24) of a hexahedron with eight nodes, by two Gauss points a direction."""
    K, M, point = np.zeros((24, 24)), np.zeros((24, 24)), 1 / np.sqrt(3)
    shear, lame = YOUNG / (2 * (1 + POISSON)), YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
    D = np.diag([2 * shear] * 3 + [shear] * 3)
    D[:3, :3] += lame
    for at in product((-point, point), repeat=3):
        factors = 1 + CORNERS * at
        N = factors.prod(axis=1) / 8
        slopes = CORNERS * factors[:, [1, 0, 0]] * factors[:, [2, 2, 1]] / 8
        J = slopes.T @ corners
        B = np.zeros((6, 24))
        for i, (x, y, z) in enumerate(np.linalg.solve(J, slopes.T).T):
            B[:, 3 * i : 3 * i + 3] = [
                [x, 0, 0], [0, y, 0], [0, 0, z], [y, x, 0], [0, z, y], [z, 0, x]
            ]  # fmt: skip
        volume = np.linalg.det(J)
        K += B.T @ D @ B * volume
        M += DENSITY * np.kron(np.outer(N, N), np.eye(3)) * volume
    return K, M


class FlexibleShank:
    """Along x from a hinge at its frame, which its modes are clamped to; muscles at its middle.

    Attributes
    ----------
    nodes (k, 3), K, M (3 k, 3 k), modes (3 k, MODES)
    """

    def __init__(self):
        half = SIDE / 2
        self.nodes = np.array(
            [
                [LENGTH * i / ELEMENTS, y, z]
                for i in range(ELEMENTS + 1)
                for y in (-half, half)
                for z in (-half, half)
            ]
        )
        self._assemble_elements()
        self._add_to_a_system()

    def _assemble_elements(self):
        n = self.nodes.size
        self.K, self.M = np.zeros((n, n)), np.zeros((n, n))
        self.elements = []
        for i in range(ELEMENTS):
            corners = [number(i + (a > 0), int(b > 0), int(c > 0)) for a, b, c in CORNERS]
            rows = np.ravel([[3 * k, 3 * k + 1, 3 * k + 2] for k in corners])
            for whole, part in zip(
                (self.K, self.M), element_matrices(self.nodes[corners]), strict=True
            ):
                whole[np.ix_(rows, rows)] += part
            self.elements.append(corners)
        kept = [k for k in range(n) if k // 3 not in layer(0)]
        within = np.ix_(kept, kept)
        _, modes = scipy.linalg.eigh(self.K[within], self.M[within], subset_by_index=[0, MODES - 1])
        self.modes = np.zeros((n, MODES))
        self.modes[kept] = modes

    def _add_to_a_system(self):
        fem = FEMinterface()
        fem.nodes = {"Position": self.nodes}
        fem.elements = [{"Name": "hex", "Hex8": np.array(self.elements)}]
        fem.massMatrix = scipy.sparse.csr_matrix(self.M)
        fem.stiffnessMatrix = scipy.sparse.csr_matrix(self.K)
        fem.modeBasis = {"matrix": self.modes, "type": "NormalModes"}
        self.mbs = mbs = exu.SystemContainer().AddSystem()
        self.ground = mbs.CreateGround()
        items = ObjectFFRFreducedOrderInterface(fem).AddObjectFFRFreducedOrder(
            mbs, positionRef=[0, 0, 0], gravity=GRAVITY
        )
        ends = [
            mbs.AddMarker(MarkerBodyRigid(bodyNumber=self.ground)),
            mbs.AddMarker(MarkerNodeRigid(nodeNumber=items["nRigidBody"])),
        ]
        self.hinge = mbs.AddObject(
            GenericJoint(markerNumbers=ends, constrainedAxes=[1, 1, 1, 1, 1, 0])
        )
        self.insertion = mbs.AddMarker(
            MarkerSuperElementRigid(
                bodyNumber=items["oFFRFreducedOrder"],
                meshNodeNumbers=np.array(layer(INSERTION)),
                weightingFactors=np.full(4, 0.25),
            )
        )
        mbs.Assemble()

    def model(self):
        muscles = [
            em.Muscle(
                name,
                path=[
                    em.PathPoint(origin, link=self.ground),
                    em.PathPoint([0, 0, 0], link=self.insertion),
                ],
                **SIZE,
            )
            for name, origin in ORIGINS.items()
        ]
        reserves = [em.Reserve("hinge", 2.0)]
        return em.MusculoskeletalModel(self.mbs, {"hinge": self.hinge}, muscles, reserves=reserves)

    # The same by its nodes, with coordinates y = (z, p): u = R(z) (X + Phi p).

    def motion_of_nodes(self, y, y_t):
        """u (k, 3), du/dy (3 k, n), and u'' (3 k,) for y'' = 0."""
        z, z_t = y[0], y_t[0]
        turned = [_rotation(z + 0.5 * np.pi * order) for order in range(3)]
        turned[1][2, 2], turned[2][2, 2] = 0.0, 0.0  # derivatives of R over z
        local = self.nodes + (self.modes @ y[1:]).reshape(-1, 3)
        local_t = (self.modes @ y_t[1:]).reshape(-1, 3)
        by_modes = np.einsum("ij,kjm->kim", turned[0], self.modes.reshape(-1, 3, MODES))
        J = np.column_stack([(local @ turned[1].T).ravel(), by_modes.reshape(-1, MODES)])
        own = local @ turned[2].T * z_t**2 + 2.0 * local_t @ turned[1].T * z_t
        return local @ turned[0].T, J, own.ravel()

    def equations(self, y, y_t):
        """M (n, n) and H - Q (n,) of y."""
        _, J, own = self.motion_of_nodes(y, y_t)
        pull = np.tile(GRAVITY, len(self.nodes))
        # Exudyn's gravity has the lever arms of the undeformed body.
        undeformed = self.motion_of_nodes(np.append(y[:1], np.zeros(MODES)), y_t)[1]
        bias = J.T @ self.M @ own - undeformed.T @ self.M @ pull
        bias[1:] += self.modes.T @ self.K @ self.modes @ y[1:]
        return J.T @ self.M @ J, bias

    def pulls(self, y):
        """-dl/dy (n,) of both muscles."""
        u, J, _ = self.motion_of_nodes(y, np.zeros(y.size))
        at = layer(INSERTION)
        found = []
        for origin in ORIGINS.values():
            along = u[at].mean(axis=0) - origin
            found.append(-along / np.linalg.norm(along) @ J.reshape(-1, 3, y.size)[at].mean(axis=0))
        return np.array(found)

    def energy(self, y, y_t):
        u, J, _ = self.motion_of_nodes(y, y_t)
        pull = np.tile(GRAVITY, len(self.nodes))
        shape = self.modes @ y[1:]
        kinetic = 0.5 * y_t @ J.T @ self.M @ J @ y_t
        return kinetic - pull @ self.M @ u.ravel() + 0.5 * shape @ self.K @ shape


def _rotation(z):
    c, s = np.cos(z), np.sin(z)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
