"""The page of a report: libraries, scene and curves in one file of HTML."""

from __future__ import annotations

import base64
import html
import json
import re
import zlib
from importlib.resources import files
from typing import Any

from .scene import Scene

COMPRESSION = 9


def assembled(scene: Scene, contents: dict[str, Any]) -> str:
    """The page as text.

    What it is of, names of muscles among them, goes into a JSON that no browser reads as HTML; the
    page's own policy keeps it from any network.
    """
    import k3d
    from plotly.offline import get_plotlyjs

    k3d_source = files(k3d).joinpath("static", "standalone.js").read_text(encoding="utf-8")
    k3d_source = re.sub(r"url\(fonts/[^)]*\)", "url(data:,)", k3d_source)  # of files beside it
    results = [
        result | parts._asdict()
        for result, parts in zip(contents["results"], scene.parts, strict=True)
    ]
    shown = contents | {"results": results, "start": scene.start, "end": scene.end}
    own = files(__package__)
    parts = {
        "TITLE": html.escape(" | ".join(result["label"] for result in results)),
        "STYLE": own.joinpath("page.css").read_text(encoding="utf-8"),
        "SCRIPT": own.joinpath("page.js").read_text(encoding="utf-8"),
        "PLOTLY": _packed(get_plotlyjs().encode()),
        "K3D": _packed(k3d_source.encode()),
        "SCENE": base64.b64encode(scene.snapshot).decode(),
        "DATA": _json(shown),
    }
    before, *rest = own.joinpath("page.html").read_text(encoding="utf-8").split("[[")
    found = [before]
    for piece in rest:  # not by replacing, as a part may contain another's name
        name, after = piece.split("]]", 1)
        found += [parts[name], after]
    return "".join(found)


def _packed(content: bytes) -> str:
    return base64.b64encode(zlib.compress(content, COMPRESSION)).decode()


def _json(data: dict[str, Any]) -> str:
    """JSON in which no character begins or ends anything in HTML."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
