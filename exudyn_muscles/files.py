"""Files on disk, whole or not at all: how every file of this package is read and written."""

from __future__ import annotations

import os
import secrets
import stat
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def write_file(file: str | Path, content: bytes) -> None:
    """Write a file that is there whole or not at all, whatever happens meanwhile.

    The content goes to a new file in the same folder, which takes the place of an earlier one once
    it is on the disk. A link stays a link; what is no regular file, such as a terminal or a pipe,
    is written to as it is.

    Raises
    ------
    OSError
        The disk is full, the folder is missing, an earlier file is protected, and so on; names the
        file. What was there before is as it was.
    """
    try:
        _replace(file, content)
    except OSError as error:
        if error.errno is None:
            raise
        # An error while writing names no file, and one about the new file not the user's.
        raise OSError(error.errno, error.strerror, str(file)) from error


def write_arrays(file: str | Path, /, **arrays: ArrayLike) -> None:
    """Write NumPy arrays, and texts as such, to an `.npz` file.

    Raises
    ------
    OSError
        As `write_file`.
    """
    content = BytesIO()
    np.savez_compressed(content, **arrays)  # type: ignore[arg-type]
    write_file(file, content.getvalue())


def write_figure(figure: Figure, file: str | Path, dpi: float) -> None:
    """Write a matplotlib figure in the format that the file's name ends with.

    Raises
    ------
    OSError
        As `write_file`.
    ValueError
        matplotlib does not know the format.
    """
    content = BytesIO()
    figure.savefig(content, format=Path(file).suffix[1:] or None, dpi=dpi)
    write_file(file, content.getvalue())


def _replace(file: str | Path, content: bytes) -> None:
    place = os.path.realpath(file)
    mode = None
    with suppress(FileNotFoundError):
        mode = os.stat(file).st_mode
    if mode is not None and not stat.S_ISREG(mode):
        with open(file, "wb") as stream:
            stream.write(content)
        return
    if mode is not None:
        os.close(os.open(place, os.O_WRONLY))  # refused where writing to it would be
    # Short, as names may be as long as a file system allows.
    beside = os.path.join(os.path.dirname(place), f".{secrets.token_hex(8)}.tmp")
    try:
        with open(beside, "xb") as stream:
            if mode is not None:
                os.chmod(beside, stat.S_IMODE(mode))
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(beside, place)
    except BaseException:
        with suppress(OSError):
            os.unlink(beside)
        raise
