"""Elements of OpenSim's files: what they say, and where they stand.

As OpenSim does, what is not known is ignored, and of properties given twice the first one counts;
here a warning says so, once for each kind of element and file.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np

from ..errors import ModelError, ModelFileError, ModelFileWarning, ParameterError, cut, warn

# In SI units nothing in a skeleton is that large, and its fifth power is a number still.
LARGEST_NUMBER = 1e30
MOST_TOLD = 100  # kinds of warnings of one file
# Of files without a version, as OpenSim has it.
UNVERSIONED = 10500
# What tells how things look, arranges them or says how OpenSim computes, in every version.
HARMLESS = frozenset([
    "Appearance", "FrameGeometry", "VisibleObject", "attached_geometry", "color", "default_color",
    "display_preference", "frame_geometry", "geometry", "geometry_files", "groups",
    "show_axes", "use_euler_angles",
])  # fmt: skip
NOT_TOLD = ("", "OpenSimDocument", "Model", "objects")  # on the way to an element
# Any of these may switch a force, constraint or controller off.
ON = ("appliesForce", "isEnforced", "enabled")
SINCE_ENABLED = 30509  # version of the format; before it there was `isDisabled`
TRUTH = {"true": True, "false": False, "1": True, "0": False}
# What stands for no file or column.
NOT_GIVEN = ("", "Unassigned")
FUNCTIONS = frozenset([
    "Constant", "GCVSpline", "LinearFunction", "MultiplierFunction", "PiecewiseConstantFunction",
    "PiecewiseLinearFunction", "PolynomialFunction", "SimmSpline", "Sine", "StepFunction",
])  # fmt: skip
UNKNOWN = "OpenSim does not know this and ignores it, and so it is ignored here"
TWICE = "it is given before, and only the first one counts"


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
    told : set of str
        Of the file's outermost element: what has been warned of.
    """

    file: str
    tag: str
    name: str
    line: int
    parent: Element | None
    children: list[Element] = field(default_factory=list)
    pieces: list[str] = field(default_factory=list)
    told: set[str] | None = None

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
        """Parameters that are outside their ranges, and loops that do not close, are this one's."""
        try:
            yield
        except (ModelError, ParameterError) as error:
            raise self.error(str(error)) from None

    def refuse(self) -> NoReturn:
        """Raise ModelFileError: this cannot be represented."""
        raise self.error("this cannot be represented")

    def warn(self, text: str) -> None:
        """Issue a ModelFileWarning about this element if it is the first of its kind in the file.

        After a hundred kinds no more is told.
        """
        outermost, tag = self, self.parent.tag if self.parent is not None else ""
        while outermost.parent is not None:
            outermost = outermost.parent
        kind = f"{tag}/{self.tag}: {text}"
        told = outermost.told
        if told is not None and kind not in told and len(told) < MOST_TOLD:
            told.add(kind)
            more = outermost.count(tag, self.tag) - 1 if text == UNKNOWN else 0
            others = f" (and in {more} more places)" if more > 0 else ""
            warn(f"{self.error(text)}{others}", ModelFileWarning)

    def count(self, parent: str, tag: str) -> int:
        """How many elements below this one have such a tag and parent."""
        waiting, found = [self], 0
        while waiting:
            element = waiting.pop()
            waiting += element.children
            if element.tag == parent:
                found += sum(child.tag == tag for child in element.children)
        return found

    def allow(self, *tags: str) -> None:
        """Warn of children that are neither known nor harmless.

        The tags are all that OpenSim's class has: what else there is, it does not read.
        """
        for child in self.children:
            if child.tag not in tags and child.tag not in HARMLESS:
                child.warn(UNKNOWN)

    @property
    def is_on(self) -> bool:
        """Whether a force, constraint or controller does anything."""
        off = self.flag("isDisabled")
        if off and self.version >= SINCE_ENABLED:
            self.get("isDisabled").warn(
                "OpenSim does not read this in files of version 4, and so it does nothing here"
            )
            off = False
        return not off and all(self.flag(name, True) for name in ON)

    @property
    def version(self) -> int:
        """Version of the file's format."""
        element = self
        while element.tag != "OpenSimDocument":
            if element.parent is None:
                return UNVERSIONED
            element = element.parent
        return int(element.name)

    def properties(self, *apart: str) -> list[Element]:
        """The children without the properties `apart`, the first one of each tag."""
        found: dict[str, Element] = {}
        for child in self.children:
            if not {child.tag, child.name} & set(apart):
                first = found.setdefault(child.tag, child)
                if first is not child:
                    child.warn(TWICE)
        return list(found.values())

    def find(self, *tags: str) -> Element | None:
        """The first child with one of these tags, if there is any."""
        found = [child for child in self.children if child.tag in tags]
        if len(found) > 1:
            found[1].warn(TWICE)
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
        """The members of this set, which may have some properties beside them."""
        defaults = self.find("defaults")
        if defaults is not None and defaults.children:
            defaults.warn("OpenSim reads those of a whole file only, and so they are ignored here")
        objects = self.find("objects")
        if objects is not None:
            # Old sets of forces may have a `datafile`.
            empty = not self.word("datafile", default="")
            self.allow("objects", "defaults", *properties, *(["datafile"] if empty else []))
            return list(objects.children)
        beside = ("groups", "defaults", *properties)
        return [member for member in self.children if member.tag not in beside]

    def objects(self, tag: str) -> list[Element]:
        """What may be the property `tag`: in an element of that tag, or of that name, or else a
        function without a name."""
        found = self.find(tag)
        if found is not None:
            return found.children
        named = [child for child in self.children if child.name == tag]
        nameless = (child for child in self.children if not child.name and child.tag in FUNCTIONS)
        return named or list(nameless)[:1]

    def object(self, tag: str) -> Element:
        """The object that is the property `tag`."""
        inside = self.objects(tag)
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
