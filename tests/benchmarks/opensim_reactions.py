"""OpenSim's own JointReaction of forces and states, in a process of its own and without this
package: `joint_reactions` starts it in the model's folder.

python opensim_reactions.py MODEL STEM REPORT [--forces FILE ...] [--loads FILE]

STEM_states.sto and STEM_forces.sto are given. REPORT (.json) gets the CPU time, the file of the
reactions, and the joints with their coordinates.
"""

import json
import sys
from pathlib import Path
from time import process_time

from opensim_replay import arguments  # beside this script


def listed(opensim, texts):
    found = opensim.ArrayStr()
    for text in texts:
        found.append(text)
    return found


def reactions(file, stem, forces, loads):
    """The report."""
    import opensim

    opensim.Logger.setLevelString("error")
    wanted = opensim.JointReaction()
    wanted.setName("JointReaction")
    wanted.setForcesFileName(f"{stem}_forces.sto")
    wanted.setJointNames(listed(opensim, ["ALL"]))
    times = opensim.Storage(f"{stem}_states.sto")
    tool = opensim.AnalyzeTool()
    tool.setName("it")
    tool.setModelFilename(str(Path(file).resolve()))
    tool.setReplaceForceSet(False)
    tool.setForceSetFiles(listed(opensim, [str(Path(each).resolve()) for each in forces]))
    tool.setStatesFileName(f"{stem}_states.sto")
    tool.setInitialTime(times.getFirstTime())
    tool.setFinalTime(times.getLastTime())
    tool.setResultsDir(str(Path(stem).parent))
    tool.setSolveForEquilibrium(False)
    if loads is not None:
        tool.setExternalLoadsFileName(str(Path(loads).resolve()))
    tool.updAnalysisSet().cloneAndAppend(wanted)
    tool.printToXML(f"{stem}_setup.xml")
    tool = opensim.AnalyzeTool(f"{stem}_setup.xml")
    model = opensim.Model(file)
    model.initSystem()
    begun = process_time()
    if not tool.run():
        sys.exit("OpenSim's AnalyzeTool gave up")
    joints = [model.getJointSet().get(k) for k in range(model.getNumJoints())]
    return {
        "version": opensim.GetVersion(),
        "cpu_time": process_time() - begun,
        "file": str(Path(stem).parent / "it_JointReaction_ReactionLoads.sto"),
        "joints": {
            joint.getName(): [
                joint.get_coordinates(k).getName() for k in range(joint.numCoordinates())
            ]
            for joint in joints
        },
    }


def main():
    given = arguments(__doc__)
    report = reactions(given.model, given.stem, given.forces, given.loads)
    given.report.write_text(json.dumps(report))


if __name__ == "__main__":
    main()
