"""One command, from its arguments to the exit status."""

from __future__ import annotations

import argparse
import sys
import traceback
from collections.abc import Sequence

from .arguments import build_parser
from .interrupts import Terminated, terminable, uninterrupted
from .names import FAILED, INTERRUPTED, PROGRAM, TERMINATED
from .terminal import forgiving_streams, in_one_line, log_lines, one_line_warnings


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments without the program's name; those of the process if left out.

    Returns
    -------
    int
        Exit status: 0 done, or the results agree; 1 they differ; 2 an error; 130 interrupted; 143
        terminated by SIGTERM.
    """
    with forgiving_streams(), terminable():
        return _run(build_parser().parse_args(argv))


def _run(arguments: argparse.Namespace) -> int:
    try:
        with one_line_warnings(), log_lines():
            status = arguments.command(arguments)
            print(end="", flush=True)  # an output that is lost on a full disk is an error
            return status
    except (Exception, KeyboardInterrupt) as error:  # a model's own code can raise anything
        with uninterrupted():  # it ends already
            if arguments.traceback:
                traceback.print_exc()
            print(f"{PROGRAM}: error: {in_one_line(error, arguments)}", file=sys.stderr)
        if isinstance(error, Terminated):
            return TERMINATED
        return INTERRUPTED if isinstance(error, KeyboardInterrupt) else FAILED
