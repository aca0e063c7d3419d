"""OpenSim's own CMC and the replay of its controls, in a process of its own and without this
package: `opensim_side_by_side` starts it in a case's folder.

python opensim_cmc.py SETUP INITIAL_TIME FINAL_TIME [FORWARD_SETUP]

FORWARD_SETUP makes the desired motion first. It leaves `opensim.json` with the CPU times and, under
`RESULTS`, copies of the files that OpenSim wrote: it spoils the header of a tool's states file when
the process ends.
"""

import json
import shutil
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from time import process_time

RESULTS = Path("side_by_side")
REPORT = Path("opensim.json")
DIGITS = 17  # so that the replay starts from the same state


def run(tool):
    """CPU seconds of a tool's run, without loading its model."""
    begun = process_time()
    if not tool.run():
        sys.exit(f"OpenSim's {tool.getConcreteClassName()} {tool.getName()} gave up")
    return process_time() - begun


def keep(tool, kind, name):
    """Copy a tool's result file."""
    file = Path(tool.getResultsDir(), f"{tool.getName()}_{kind}")
    shutil.copy(file, RESULTS / name)


def forward_setup(setup, controls, states, initial_time, final_time):
    """The set-up of a forward simulation with CMC's model, forces, tolerances and controls."""
    root = ElementTree.parse(setup).getroot()
    tool = root.find("CMCTool")
    tool.tag = "ForwardTool"
    changes = {
        "initial_time": initial_time,
        "final_time": final_time,
        "solve_for_equilibrium_for_auxiliary_states": "false",
        "states_file": states,
        "results_directory": RESULTS / "forward",
        "output_precision": DIGITS,
    }
    for name, value in changes.items():
        found = tool.find(name)
        element = ElementTree.SubElement(tool, name) if found is None else found
        element.text = str(value)
    controllers = tool.find("ControllerSet/objects")
    controller = ElementTree.SubElement(controllers, "ControlSetController", name="replay")
    ElementTree.SubElement(controller, "controls_file").text = str(controls)
    file = Path("side_by_side_forward.xml")
    ElementTree.ElementTree(root).write(file)
    return file


def main(setup, initial_time, final_time, motion_setup=None):
    import opensim

    opensim.Logger.setLevelString("error")
    RESULTS.mkdir()
    if motion_setup is not None:
        run(opensim.ForwardTool(motion_setup))
    cmc = opensim.CMCTool(setup)
    cmc.setInitialTime(float(initial_time))
    cmc.setFinalTime(float(final_time))
    cmc.setOutputPrecision(DIGITS)
    cpu_time = run(cmc)
    keep(cmc, "states.sto", "states.sto")
    keep(cmc, "pErr.sto", "errors.sto")
    keep(cmc, "controls.xml", "controls.xml")

    states = opensim.Storage(str(RESULTS / "states.sto"))
    file = forward_setup(
        setup, RESULTS / "controls.xml", RESULTS / "states.sto", states.getFirstTime(),
        states.getLastTime(),
    )  # fmt: skip
    replay = opensim.ForwardTool(str(file))
    replay_cpu_time = run(replay)
    keep(replay, "states.sto", "replay.sto")
    report = {
        "version": opensim.GetVersion(),
        "cpu_time": cpu_time,
        "replay_cpu_time": replay_cpu_time,
    }
    REPORT.write_text(json.dumps(report))


if __name__ == "__main__":
    main(*sys.argv[1:])
