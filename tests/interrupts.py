"""Exceptions raised at chosen lines of the package, as Ctrl-C can be at any of them."""

import sys
from collections import defaultdict
from contextlib import contextmanager
from pathlib import Path

import exudyn_muscles as em

PACKAGE = str(Path(em.__file__).parent)


class Tracer:
    """Numbers the lines of the package as they are executed, and raises at one of them."""

    def __init__(self, at=None):
        self.at = at
        self.lines = []

    def __call__(self, frame, event, _):
        return self._in_package if frame.f_code.co_filename.startswith(PACKAGE) else None

    def _in_package(self, frame, event, _):
        if event == "line":
            self.lines.append((frame.f_code.co_filename, frame.f_lineno))
            if len(self.lines) - 1 == self.at:
                sys.settrace(None)
                raise KeyboardInterrupt
        return self._in_package


@contextmanager
def traced(at=None):
    """The block's lines; at the line with the number `at` KeyboardInterrupt is raised."""
    tracer = Tracer(at)
    sys.settrace(tracer)
    try:
        yield tracer
    finally:
        sys.settrace(None)


def lines_of(run, known):
    """Numbers of executed lines at which lines of the package that are not `known` occur first and
    last; they are known from then on."""
    with traced() as tracer:
        run()
    occurrences = defaultdict(list)
    for number, line in enumerate(tracer.lines):
        occurrences[line].append(number)
    new = [each for line, each in occurrences.items() if line not in known]
    known.update(occurrences)
    return sorted({number for each in new for number in (each[0], each[-1])})
