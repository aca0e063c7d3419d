"""XML of model files as elements that know their place in the file.

The files come from strangers: a DOCTYPE is refused and with it every entity, nothing is fetched,
and size, depth and number of elements are limited.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn
from xml.parsers import expat

import numpy as np

from ..errors import ModelFileError, ParameterError, cut
from ..files.disk import read_file

# Far above what is in use: a model of 92 muscles has 1 MB in 10,000 elements, of which none lies
# more than 14 deep, and its longest spline 600 characters. Controls of a long run have most.
LARGEST = 100e6  # bytes
MOST_ELEMENTS = 1_000_000
DEEPEST = 200  # elements within each other
LONGEST_TEXT = 1_000_000  # characters of one property
# In SI units nothing in a skeleton is that large, and its fifth power is a number still.
LARGEST_NUMBER = 1e30
OLDEST, NEWEST = 20000, 50000
# What tells how things look, or arranges them, in every version.
HARMLESS = frozenset(
    ["Appearance", "FrameGeometry", "VisibleObject", "attached_geometry", "default_color", "groups"]
)
NOT_TOLD = ("", "OpenSimDocument", "Model", "objects")  # on the way to an element
# Any of these may switch a force, constraint or controller off.
ON = ("appliesForce", "isEnforced", "enabled")
TRUTH = {"true": True, "false": False, "1": True, "0": False}
# What objects of older versions are called now.
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
}
# What stands for no file or column.
NOT_GIVEN = ("", "Unassigned")


@dataclass(eq=False, slots=True)
class Element:
    """An element of a model file.

    Attributes
    ----------
    file : str
    tag, name : str
        The name is empty if it has none.
    line : int
        Where it begins, from 1.
    parent : Element or None
    children : list of Element
    pieces : list of str
        Its text as it was read.
    """

    file: str
    tag: str
    name: str
    line: int
    parent: Element | None
    children: list[Element] = field(default_factory=list)
    pieces: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        named = self.name and not self.tag.endswith("Set")
        return f"{cut(self.tag)} '{cut(self.name)}'" if named else cut(self.tag)

    @property
    def text(self) -> str:
        """The text without blanks at both ends."""
        return "".join(self.pieces).strip()

    def error(self, text: str) -> ModelFileError:
        """An error about this element, with its place in the file."""
        path, element = [str(self)], self.parent
        while element is not None:
            if element.tag not in NOT_TOLD:
                path.insert(0, str(element))
            element = element.parent
        return ModelFileError(f"{self.file}, line {self.line}: {' / '.join(path)}: {text}")

    @contextmanager
    def blamed(self) -> Iterator[None]:
        """Parameters that are outside their ranges are this element's."""
        try:
            yield
        except ParameterError as error:
            raise self.error(str(error)) from None

    def refuse(self) -> NoReturn:
        """Raise ModelFileError: this cannot be represented."""
        raise self.error("this cannot be represented")

    def allow(self, *tags: str) -> None:
        """Raise ModelFileError unless all children are known, or harmless."""
        for child in self.children:
            if child.tag not in tags and child.tag not in HARMLESS:
                raise child.error("this is not known, and might change what the model does")

    @property
    def is_on(self) -> bool:
        """Whether a force, constraint or controller does anything."""
        return all(self.flag(name, True) for name in ON) and not self.flag("isDisabled")

    @property
    def version(self) -> int:
        """Version of the file's format; the oldest where the file does not say it."""
        element = self
        while element.tag != "OpenSimDocument":
            if element.parent is None:
                return OLDEST
            element = element.parent
        return int(element.name)

    def properties(self, *apart: str) -> list[Element]:
        """The children without the properties `apart`, if each is the only one with its tag."""
        found = [child for child in self.children if not {child.tag, child.name} & set(apart)]
        for tag, count in Counter(child.tag for child in found).items():
            if count > 1:
                self.find(tag)
        return found

    def find(self, *tags: str) -> Element | None:
        """The one child with one of these tags, if there is any."""
        found = [child for child in self.children if child.tag in tags]
        if len(found) > 1:
            raise found[1].error(f"given before, in line {found[0].line}")
        return found[0] if found else None

    def get(self, *tags: str) -> Element:
        """The one child with one of these tags."""
        found = self.find(*tags)
        if found is None:
            raise self.error(f"there is no {' or '.join(tags)} in it")
        return found

    def items(self, tag: str) -> list[Element]:
        """The members of the set `tag`, if there is one."""
        found = self.find(tag)
        return [] if found is None else found.members()

    def members(self, *properties: str) -> list[Element]:
        """The members of this set, which may have some properties beside them; defaults of what
        members leave out are refused."""
        defaults = self.find("defaults")
        if defaults is not None and defaults.children:
            defaults.refuse()
        objects = self.find("objects")
        if objects is not None:
            # Old sets of forces may have a `datafile`.
            empty = not self.word("datafile", default="")
            self.allow("objects", "defaults", *properties, *(["datafile"] if empty else []))
            return list(objects.children)
        beside = ("groups", "defaults", *properties)
        return [member for member in self.children if member.tag not in beside]

    def object(self, tag: str) -> Element:
        """The object that is the property `tag`: in an element of that tag, or of that name."""
        named = [child for child in self.children if child.name == tag]
        found = self.find(tag)
        inside = named if found is None else found.children
        if len(inside) != 1:
            raise self.error(f"expected one object as its {tag}, found {len(inside)}")
        return inside[0]

    def word(self, *tags: str, default: str | None = None) -> str:
        """A property's text, or the default if it is not there or empty."""
        found = self.find(*tags) if default is not None else self.get(*tags)
        if found is not None and found.text:
            return found.text
        if default is None:
            raise self.get(*tags).error("it is empty")
        return default

    def flag(self, tag: str, default: bool = False) -> bool:
        """Whether a property is true."""
        if not self.word(tag, default=""):
            return default
        return self.get(tag).flags(1)[0]

    def number(self, tag: str, default: float | None = None, *, infinite: bool = False) -> float:
        """A property that is one number."""
        if default is not None and not self.word(tag, default=""):
            return default
        return float(self.get(tag).numbers(1, infinite=infinite)[0])

    def vector(self, tag: str, size: int = 3, default: Sequence[float] | None = None) -> np.ndarray:
        """A property that is several numbers (size,)."""
        if default is not None and not self.word(tag, default=""):
            return np.array(default, dtype=float)
        return self.get(tag).numbers(size)

    def flags(self, size: int | None = None) -> list[bool]:
        """The text as truth values (size,)."""
        words = self.text.lower().split()
        if size not in (None, len(words)) or not TRUTH.keys() >= set(words):
            raise self.error(f"expected true or false, got '{cut(self.text)}'")
        return [TRUTH[word] for word in words]

    def numbers(self, size: int | None = None, *, infinite: bool = False) -> np.ndarray:
        """The text as numbers (size,)."""
        try:
            values = np.array([float(word) for word in self.text.split()])
        except ValueError:
            values = np.array([math.nan])
        if np.isnan(values).any():
            raise self.error(f"expected numbers, got '{cut(self.text)}'")
        if not infinite and (np.abs(values) > LARGEST_NUMBER).any():
            raise self.error(f"expected numbers up to {LARGEST_NUMBER:g}, got '{cut(self.text)}'")
        if size is not None and values.size != size:
            raise self.error(f"expected {size} numbers, got {values.size}")
        return values


def read_document(file: str | Path, *tags: str) -> Element:
    """The object that a file of OpenSim holds: the `Model` of an `.osim` file, or one of `tags`.

    Old files of other objects lack the `OpenSimDocument` around them.

    Raises
    ------
    ModelFileError
        It is no such file, is damaged, or has a version other than 2 to 4.
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
    if not re.fullmatch("[0-9]{5}", version) or not OLDEST <= int(version) < NEWEST:
        raise document.error(f"format version '{cut(version)}' is not one of OpenSim 2 to 4")
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
    parser = expat.ParserCreate()
    parser.buffer_text = True
    root = Element(file, "", "", 0, None)
    open_elements = [root]
    elements = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal elements
        elements += 1
        if elements > MOST_ELEMENTS:
            raise open_elements[-1].error(f"more than {MOST_ELEMENTS} elements in one file")
        if len(open_elements) > DEEPEST:
            raise open_elements[-1].error(f"more than {DEEPEST} elements within each other")
        tag = RENAMED.get(tag, tag)
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
