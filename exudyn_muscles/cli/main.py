"""One command, from its arguments to the exit status."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Sequence

from .arguments import build_parser
from .names import FAILED, INTERRUPTED, PROGRAM
from .terminal import in_one_line, one_line_warnings


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments without the program's name; those of the process if left out.

    Returns
    -------
    int
        Exit status: 0 done, or the results agree; 1 they differ; 2 an error; 130 interrupted.
    """
    arguments = build_parser().parse_args(argv)
    try:
        with one_line_warnings():
            return arguments.command(arguments)
    except (Exception, KeyboardInterrupt) as error:  # a model's own code can raise anything
        if arguments.traceback:
            traceback.print_exc()
        print(f"{PROGRAM}: error: {in_one_line(error, arguments)}", file=sys.stderr)
        return INTERRUPTED if isinstance(error, KeyboardInterrupt) else FAILED
