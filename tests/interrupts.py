"""Exceptions raised at chosen lines of Python, as Ctrl-C can be at any of them."""

import contextlib
import dataclasses
import gc
import sys
from collections import defaultdict
from pathlib import Path

# Not those of the tests; nor of contextlib, where a run that is interrupted between its hold and
# the block lasts as long as the traceback; nor of a dataclass's `repr`, which then stays "...".
LEFT_OUT = (str(Path(__file__).parent), contextlib.__file__, dataclasses.__file__, "<")


class traced:
    """Numbers the lines that the block executes, the package's and those of its libraries; at the
    line with the number `at` KeyboardInterrupt is raised."""

    def __init__(self, at=None):
        self.at = at
        self.lines = []

    def __enter__(self):
        gc.disable()  # what libraries do when it runs is executed at any time
        sys.settrace(self._enter_frame)
        return self

    def __exit__(self, *_):
        sys.settrace(None)
        gc.enable()

    def _enter_frame(self, frame, event, _):
        return None if frame.f_code.co_filename.startswith(LEFT_OUT) else self._in_frame

    def _in_frame(self, frame, event, _):
        if event == "line":
            self.lines.append((frame.f_code.co_filename, frame.f_lineno))
            if len(self.lines) - 1 == self.at:
                sys.settrace(None)
                raise KeyboardInterrupt
        return self._in_frame


def lines_of(run, known):
    """Numbers of executed lines at which lines that are not `known` occur first and last; they are
    known from then on."""
    with traced() as tracer:
        run()
    occurrences = defaultdict(list)
    for number, line in enumerate(tracer.lines):
        occurrences[line].append(number)
    new = [each for line, each in occurrences.items() if line not in known]
    known.update(occurrences)
    return sorted({number for each in new for number in (each[0], each[-1])})
