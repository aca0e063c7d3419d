"""Files of this package replayed by OpenSim's Manager, in a process of its own and without the
package: `replay_in_opensim` and a test start it in the model's folder.

python opensim_replay.py MODEL STEM REPORT [--forces FILE ...] [--loads FILE]

The model runs from the first row of STEM_states.sto with the controls in STEM_controls.sto. REPORT
(.json) gets, of every coordinate at the rows' times, the difference of the run from the row, and
the acceleration that OpenSim finds for the row's state.
"""

import argparse
import json
import sys
from pathlib import Path

ACCURACY = 1e-6


def replay(file, stem, forces, loads):
    """The report."""
    import opensim

    opensim.Logger.setLevelString("error")
    model = opensim.Model(file)
    for each in forces:
        added = opensim.ForceSet(each)
        for k in range(added.getSize()):
            model.addForce(added.get(k).clone())
    if loads is not None:
        model.addModelComponent(opensim.ExternalLoads(loads, True))
    model.addController(opensim.PrescribedController(f"{stem}_controls.sto"))
    listed = model.getCoordinateSet()
    coordinates = [listed.get(k) for k in range(listed.getSize())]
    # A locked coordinate would be read as NaN: it is locked again in every state.
    locked = [each for each in coordinates if each.getDefaultLocked()]
    for each in locked:
        each.setDefaultLocked(False)
    model.initSystem()
    rows = opensim.StatesTrajectory.createFromStatesStorage(model, f"{stem}_states.sto")
    states = [opensim.State(rows.get(k)) for k in range(rows.getSize())]
    for state in states:
        for each in locked:
            each.setLocked(state, True)
    report = {each.getName(): {"differences": [], "accelerations": []} for each in coordinates}
    manager = opensim.Manager(model)
    manager.setIntegratorAccuracy(ACCURACY)
    manager.initialize(opensim.State(states[0]))
    for k, row in enumerate(states):
        model.realizeAcceleration(row)
        reached = manager.integrate(row.getTime()) if k else row
        for each in coordinates:
            found = report[each.getName()]
            found["differences"].append(each.getValue(reached) - each.getValue(row))
            found["accelerations"].append(each.getAccelerationValue(row))
    return report


def arguments(text):
    """What such a script is called with."""
    parser = argparse.ArgumentParser(description=text.splitlines()[0])
    parser.add_argument("model")
    parser.add_argument("stem")
    parser.add_argument("report", type=Path)
    parser.add_argument("--forces", nargs="*", default=[])
    parser.add_argument("--loads")
    return parser.parse_args()


def main():
    given = arguments(__doc__)
    report = replay(given.model, given.stem, given.forces, given.loads)
    given.report.write_text(json.dumps(report))


if __name__ == "__main__":
    sys.exit(main())
