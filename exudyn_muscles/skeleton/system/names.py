"""What the coordinates of a system are called."""

from __future__ import annotations

import exudyn as exu


def system_names(mbs: exu.MainSystem) -> tuple[str, ...]:
    """Names of all N coordinates x, by their nodes and numbers there, as `node 3 'thigh': 0`."""
    data = mbs.systemData
    names = [f"coordinate {k}" for k in range(data.ODE2Size())]
    for node in range(data.NumberOfNodes()):
        for i, k in enumerate(data.GetNodeLTGODE2(node)):
            # `CreateRigidBody` puts this in front of the body's name.
            name = mbs.GetNode(node)["name"].removeprefix("Node:")
            names[k] = f"node {node} '{name}': {i}"
    return tuple(names)
