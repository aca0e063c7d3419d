"""The object by which the plugin's loads get into a system."""

from __future__ import annotations

import exudyn as exu
import numpy as np

from ...errors import ModelError
from ..assembly import assembled_anew


def force_object(mbs: exu.MainSystem) -> tuple[exu.ObjectIndex, np.ndarray]:
    """The object by which generalized forces get into a system, and its coordinates there.

    It has the name of this package, no mass, and no force but in a run. The first model of a system
    adds it; Exudyn assembles anew, and the state is as before.
    """
    name, data = "exudyn_muscles", mbs.systemData
    nodes = [k for k in range(data.NumberOfNodes()) if len(data.GetNodeLTGODE2(k))]
    if not nodes:
        raise ModelError("the mbs has no node with coordinates: there is nothing that can move")
    for number in range(data.NumberOfObjects()):
        item = mbs.GetObject(number)
        if item["objectType"] == "GenericODE2" and item["name"] == name:
            if [int(node) for node in item["nodeNumbers"]] != nodes:
                raise ModelError(
                    f"the mbs has got other nodes since object {number} '{name}' was added to it: "
                    "build it and its model anew"
                )
            found = exu.ObjectIndex(number)
            break
    else:
        size = data.ODE2Size()
        with assembled_anew(mbs):
            found = mbs.AddObject(
                {
                    "objectType": "GenericODE2", "name": name, "nodeNumbers": nodes,
                    "forceVector": np.zeros(size), "Vshow": False,
                }
            )  # fmt: skip
    return found, np.array(data.GetObjectLTGODE2(found), dtype=np.int64)
