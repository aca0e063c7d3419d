"""Run the examples for their pages: `python run_examples.py FOLDER SCRIPT...`.

Pictures go into FOLDER, and `results.json` there says of every script what it printed, which
pictures there are, and by which expression one was drawn for a script that draws none itself.
"""

import contextlib
import io
import json
import os
import runpy
import shutil
import sys
import tempfile
from pathlib import Path

PICTURES = {
    "01": "em.plot.excitations(result)",
    "02": "em.view.render(model, result, 0.5, picture)",
    "03": "em.plot.forces(result)",
    "04": "em.plot.tracking_errors(*results[1:])",
    "06": "em.plot.tracking_errors(cmc)",
    "08": "em.plot.excitations(alone, helped)",
    "10": "em.plot.tracking_errors(*results.values())",
    "11": "table.plot.scatter(STRENGTH, 'peak', c=SLACK, colormap='viridis')",
}


def main(folder, *scripts):
    import matplotlib
    import matplotlib.pyplot as plt

    import exudyn_muscles as em

    matplotlib.rcParams["savefig.dpi"] = 100
    results = {}
    for script in map(Path, scripts):
        with tempfile.TemporaryDirectory() as work, contextlib.chdir(work):
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                variables = runpy.run_path(str(script), run_name="__main__")
            picture = Path("out") / f"{script.stem}.png"
            drawn = PICTURES.get(script.name[:2], "")
            if drawn:
                picture.parent.mkdir(exist_ok=True)
                eval(drawn, variables | {"em": em, "picture": str(picture)})
                if not picture.is_file():
                    plt.savefig(picture, bbox_inches="tight")
            plt.close("all")
            made = sorted(Path("out").glob("*.png"), key=os.path.getmtime)
            pictures = [f"{script.stem}_{k}.png" for k in range(len(made))]
            for source, name in zip(made, pictures, strict=True):
                shutil.copy(source, Path(folder) / name)
        results[script.stem] = {
            "printed": printed.getvalue(), "pictures": pictures, "drawn": drawn
        }  # fmt: skip
    (Path(folder) / "results.json").write_text(json.dumps(results))


if __name__ == "__main__":
    main(*sys.argv[1:])
