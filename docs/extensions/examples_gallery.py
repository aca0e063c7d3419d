"""Every script in `examples/` as a page: its picture, what it prints, and its code.

Before a build the scripts are run, all in one process, and pages are written into
`docs/examples/`. Where neither scripts nor package have changed since, both are left as they are.
"""

import ast
import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

from sphinx.errors import ExtensionError

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
SCRIPTS = sorted((ROOT / "examples").glob("[0-9]*.py"))
PAGES = HERE.parent / "examples"

PAGE = """# {title}

{text}

{pictures}

It prints

```text
{printed}
```

```{{literalinclude}} ../../examples/{script}
:language: python
:caption: examples/{script}
```
"""
CARD = """:::{{grid-item-card}} {title}
:link: {page}
:link-type: doc
:img-top: {picture}
:class-img-top: card-picture
{first}
:::
"""
INDEX = """# Examples

Scripts in the folder `examples/`, each whole and on its own; the tests run them all, and this site
ran them for what is shown here. What they take from the folder `models/` is built in Exudyn from
published figures.

::::{{grid}} 1 2 2 3
:gutter: 3

{cards}
::::

A notebook goes [from a recorded motion to joint loads](joint_loads.ipynb).
[More pictures](../gallery.md) show models and pages of results.

```{{toctree}}
:hidden:

{pages}
joint_loads
```
"""


def setup(app):
    app.connect("builder-inited", make_pages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def make_pages(app):
    stamp, now = PAGES / ".made_of", digest()
    if stamp.is_file() and stamp.read_text() == now:
        return
    PAGES.mkdir(exist_ok=True)
    done = subprocess.run(
        [sys.executable, str(HERE / "run_examples.py"), str(PAGES), *map(str, SCRIPTS)],
        capture_output=True, text=True, env=os.environ | {"MPLBACKEND": "Agg"},
    )  # fmt: skip
    if done.returncode != 0:
        raise ExtensionError(f"an example failed:\n{done.stdout}{done.stderr}")
    found = json.loads((PAGES / "results.json").read_text())
    cards = [write_page(script, **found[script.stem]) for script in SCRIPTS]
    pages = "\n".join(script.stem for script in SCRIPTS)
    (PAGES / "index.md").write_text(INDEX.format(cards="\n".join(cards), pages=pages))
    notebook = ROOT / "examples" / "joint_loads.ipynb"
    (PAGES / notebook.name).write_bytes(notebook.read_bytes())
    stamp.write_text(now)


def digest():
    """Of all that pages are made of."""
    files = [
        file
        for folder in ("examples", "exudyn_muscles", "models", "docs/extensions")
        for file in sorted((ROOT / folder).rglob("*"))
        if file.suffix in (".py", ".ipynb")
    ]
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


def write_page(script, printed, pictures, drawn):
    """Write the page of a script; its card on the index."""
    title = script.stem[3:].replace("_", " ").capitalize()
    text = ast.get_docstring(ast.parse(script.read_text()))
    shown = "\n\n".join(f"![{title}]({picture})" for picture in pictures)
    if drawn:
        shown += f"\n\nThe picture is `{drawn}` of the script's results."
    (PAGES / f"{script.stem}.md").write_text(
        PAGE.format(
            title=title, text=text, pictures=shown, printed=printed.rstrip(), script=script.name
        )
    )
    first = text.split("\n\n")[0].replace("\n", " ")
    return CARD.format(title=title, page=script.stem, picture=pictures[0], first=first)
