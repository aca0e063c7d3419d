"""Write the table of quantities in `docs/results.md` anew:

python -m tests.results.make_table
"""

import re
from pathlib import Path

from exudyn_muscles.results.quantities import QUANTITIES

FILE = Path(__file__).parents[2] / "docs" / "results.md"


def markdown():
    """The table."""
    head = ("field", "shape", "unit", "what it is", "tolerance of `compare`")
    rows = [
        (
            f"`{one.field}`" + (f", as `{one.name}`" if one.name != one.field else ""),
            one.symbols,
            one.unit or "-",
            one.description,
            f"{one.tolerance:g}" + (f" of the {one.scale.value}" if one.scale.value else ""),
        )
        for one in QUANTITIES
    ]
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, ("---",) * len(head), *rows))


if __name__ == "__main__":
    FILE.write_text(
        re.sub(r"^\|.*^\|[^\n]*", lambda _: markdown(), FILE.read_text(), flags=re.M | re.S)
    )
