"""XML of model files as elements that know their place in the file.

The files come from strangers: a DOCTYPE is refused and with it every entity, nothing is fetched,
and size, depth and number of elements are limited.
"""

from __future__ import annotations

import re
from pathlib import Path
from xml.parsers import expat

from ..errors import ModelFileError, cut
from ..files.disk import read_file
from .element import UNVERSIONED, Element

# Far above what is in use: a model of 92 muscles has 1 MB in 10,000 elements, of which none lies
# more than 14 deep, and its longest spline 600 characters. Controls of a long run have most.
LARGEST = 100e6  # bytes
MOST_ELEMENTS = 1_000_000
DEEPEST = 200  # elements within each other
LONGEST_TEXT = 1_000_000  # characters of one property
# Of models, and of all other files, as OpenSim 4 reads them.
OLDEST_MODEL, OLDEST, NEWEST = 10901, UNVERSIONED, 50000
# What objects and properties of older versions are called now.
RENAMED = {
    "ActuatorSet": "ForceSet",
    "GeneralizedForce": "CoordinateActuator",
    "Force": "PointActuator",
    "Torque": "TorqueActuator",
    "MuscleWrap": "PathWrap",
    "MuscleWrapSet": "PathWrapSet",
    "MusclePoint": "PathPoint",
    "MuscleViaPoint": "ConditionalPathPoint",
    "MovingMusclePoint": "MovingPathPoint",
    "MusclePointSet": "PathPointSet",
    "NaturalCubicSpline": "SimmSpline",
    "natCubicSpline": "SimmSpline",
    "rdCMC_Joint": "CMC_Joint",
    "rdCMC_Point": "CMC_Point",
    "rdCMC_TaskSet": "CMC_TaskSet",
    "XAttachment": "x_location",
    "YAttachment": "y_location",
    "ZAttachment": "z_location",
    "actuator_set_files": "force_set_files",
    "replace_actuator_set": "replace_force_set",
}
# Before this version of the format actuators pushed against their first body: OpenSim renames
# their properties, and turns their directions round.
TURNED = 10905
RENAMED_WITHIN = {
    "PointActuator": {"body_B": "body", "point_B": "point", "direction_A": "direction"},
    "TorqueActuator": {"body_A": "bodyB", "body_B": "bodyA", "direction_A": "axis"},
}


def read_document(file: str | Path, *tags: str) -> Element:
    """The object that a file of OpenSim holds: the `Model` of an `.osim` file, or one of `tags`.

    Old files of other objects lack the `OpenSimDocument` around them.

    Raises
    ------
    ModelFileError
        It is no such file, is damaged, or has a version that OpenSim 4 does not read.
    FileNotFoundError
    """
    root = _parsed(str(file), read_file(file, LARGEST, ModelFileError))
    document = root.children[0]
    if document.tag in tags:
        return _with_defaults(document)
    if document.tag != "OpenSimDocument":
        what = " or ".join(tags) or "model"
        raise document.error(f"this is not a {what} file of OpenSim 2 to 4")
    version = document.name
    oldest = OLDEST if tags else OLDEST_MODEL
    if not re.fullmatch("[0-9]{5}", version) or not oldest <= int(version) < NEWEST:
        raise document.error(f"format version '{cut(version)}' is none that OpenSim 4 reads")
    return _with_defaults(document.get(*(tags or ("Model",))))


def _with_defaults(document: Element) -> Element:
    """The object of a file, whose elements have what they leave out from the file's `defaults`."""
    defaults = document.find("defaults")
    if defaults is None:
        return document
    document.children.remove(defaults)
    usual = {each.tag: each.children for each in defaults.children}
    waiting, added = list(document.children), 0
    while waiting:
        element = waiting.pop()
        waiting += element.children
        own = {child.tag for child in element.children}
        missing = [each for each in usual.get(element.tag, ()) if each.tag not in own]
        element.children.extend(missing)
        added += len(missing)
        if added > MOST_ELEMENTS:
            raise defaults.error(f"more than {MOST_ELEMENTS} elements would be added")
    return document


def _parsed(file: str, data: bytes) -> Element:
    """The file's elements below one without a tag."""
    data = _as_opensim_reads(data)
    parser = expat.ParserCreate(_encoding(data))
    parser.buffer_text = True
    root = Element(file, "", "", 0, None, told=set())
    open_elements = [root]
    elements, turned = 0, False

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal elements, turned
        if elements == 0:
            said = attributes.get("Version", "") if tag == "OpenSimDocument" else str(UNVERSIONED)
            turned = said.isdecimal() and int(said[:6]) < TURNED
        elements += 1
        if elements > MOST_ELEMENTS:
            raise open_elements[-1].error(f"more than {MOST_ELEMENTS} elements in one file")
        if len(open_elements) > DEEPEST:
            raise open_elements[-1].error(f"more than {DEEPEST} elements within each other")
        tag = RENAMED.get(tag, tag)
        if turned:
            tag = RENAMED_WITHIN.get(open_elements[-1].tag, {}).get(tag, tag)
        name = attributes.get("Version" if tag == "OpenSimDocument" else "name", "")
        parent = open_elements[-1]
        element = Element(file, tag, name, parser.CurrentLineNumber, parent)
        parent.children.append(element)
        open_elements.append(element)

    def end(tag: str) -> None:
        element = open_elements.pop()
        element.pieces[:] = [element.text]
        if len(element.text) > LONGEST_TEXT:
            raise element.error(f"more than {LONGEST_TEXT} characters in one property")

    def doctype(*_: object) -> None:
        raise ModelFileError(f"{file}, line {parser.CurrentLineNumber}: a DOCTYPE is refused")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler = lambda text: open_elements[-1].pieces.append(text)
    parser.StartDoctypeDeclHandler = doctype
    try:
        for begin in range(0, len(data), LONGEST_TEXT):
            # A tag is kept until it is whole.
            if begin - parser.CurrentByteIndex > LONGEST_TEXT:
                raise open_elements[-1].error(f"more than {LONGEST_TEXT} characters in one tag")
            parser.Parse(data[begin : begin + LONGEST_TEXT])
        parser.Parse(b"", True)
    except expat.ExpatError as error:
        raise ModelFileError(f"{file}: not well-formed XML: {error}") from None
    except ModelFileError:
        raise
    except (LookupError, ValueError) as error:  # of Python's codecs
        raise ModelFileError(f"{file}: its encoding cannot be read: {error}") from None
    return root


def _as_opensim_reads(data: bytes) -> bytes:
    """The file without what XML forbids and OpenSim reads: comments may hold what begins another
    one, and a lone ampersand is one."""
    pieces, at = [], 0
    while (begin := data.find(b"<!--", at)) >= 0 and (end := data.find(b"-->", begin + 4)) >= 0:
        pieces += [data[at:begin], b"\n" * data.count(b"\n", begin, end)]
        at = end + 3
    return re.sub(rb"&(?![#\w]+;)", b"&amp;", b"".join([*pieces, data[at:]]))


def _encoding(data: bytes) -> str | None:
    """The encoding of a file that says UTF-8 and has single bytes in its texts; else its own."""
    try:
        data.decode("utf-8")
    except UnicodeDecodeError:
        said = re.match(rb"\s*<\?xml[^>]*encoding=[\"']utf-?8", data, re.IGNORECASE)
        return "iso-8859-1" if said else None
    return None
