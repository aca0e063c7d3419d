"""OpenSim's own static optimization, in a process of its own and without this package:
`opensim_static` starts it in the folder of a set-up.

python opensim_analyze.py SETUP

It leaves `opensim.json` with the CPU time, and the files of the tool's results.
"""

import json
import sys
from pathlib import Path
from time import process_time

REPORT = Path("opensim.json")


def main(setup):
    import opensim

    opensim.Logger.setLevelString("error")
    tool = opensim.AnalyzeTool(setup)
    begun = process_time()
    if not tool.run():
        sys.exit(f"OpenSim's AnalyzeTool {tool.getName()} gave up")
    cpu_time = process_time() - begun
    report = {"version": opensim.GetVersion(), "cpu_time": cpu_time}
    report |= {"results": tool.getResultsDir(), "name": tool.getName()}
    REPORT.write_text(json.dumps(report))


if __name__ == "__main__":
    main(*sys.argv[1:])
