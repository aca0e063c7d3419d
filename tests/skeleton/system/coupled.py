"""The constraint of `docs/skeletons.md` by which translations of a joint follow its rotation."""

import re
from pathlib import Path

DOCUMENT = Path(__file__).parents[3] / "docs" / "skeletons.md"
BLOCK = re.search(r"```python\n(import exudyn.*?)\n\n\nknee = ", DOCUMENT.read_text(), re.S)[1]
made = {}
exec(compile(BLOCK, str(DOCUMENT), "exec"), made)
couple = made["couple"]
