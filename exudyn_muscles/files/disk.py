"""Files on disk, whole or not at all: how every file of this package is read and written."""

from __future__ import annotations

import math
import os
import secrets
import stat
import zipfile
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ExudynMusclesError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Numbers hardly shrink: stored results unpack to 0.99 to 1.35 times their size. More do those that
# stay the same, such as a motion at rest; so up to some size that any machine has, all may.
RATIO, UNPACKED = 20, 256e6
MOST_ARRAYS = 1000  # of one file; a result has 20


def read_file(file: str | Path, largest: float, error: type[ExudynMusclesError]) -> bytes:
    """The content of a regular file, which may come from a stranger.

    Parameters
    ----------
    file : str or Path
    largest : float
        Size that a file of its kind can have [bytes].
    error : type
        What is raised if it is larger, or is a folder, a device or a pipe.

    Raises
    ------
    FileNotFoundError
    OSError
        The file cannot be read; names it.
    """
    status = os.stat(file)
    if not stat.S_ISREG(status.st_mode):
        raise error(f"{file}: this is no regular file")
    if status.st_size > largest:
        raise error(f"{file}: {status.st_size:.3g} bytes are too many, allowed are {largest:.3g}")
    with open(file, "rb") as stream:
        return stream.read(status.st_size)


def read_arrays(
    file: str | Path, largest: float, error: type[ExudynMusclesError]
) -> dict[str, np.ndarray]:
    """The arrays of an `.npz` file, which may come from a stranger; `largest` and `error` are those
    of `read_file`.

    Raises
    ------
    error
        The file is damaged, is none of these, or would unpack to much more than its own size.
    FileNotFoundError
    """
    content = read_file(file, largest, error)
    most = max(UNPACKED, RATIO * len(content))
    try:
        if content.count(b"PK\x01\x02") > MOST_ARRAYS:  # in the zip's directory, one for each
            raise ValueError(f"more than {MOST_ARRAYS} arrays")
        with zipfile.ZipFile(BytesIO(content)) as archive:
            size = sum(member.file_size for member in archive.infolist())
            if size > most:
                raise ValueError(f"it unpacks to {size:.3g} bytes, allowed are {most:.3g}")
            return {
                member.filename.removesuffix(".npy"): _array(archive, member)
                for member in archive.infolist()
            }
    except Exception as reason:  # zip, zlib and numpy have many ways to fail
        raise error(f"{file}: not a readable .npz file ({reason})") from reason


def _array(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> np.ndarray:
    if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError("its compression is not that of NumPy")
    with archive.open(member) as packed:
        content = packed.read(member.file_size)  # no more, whatever else unpacks
    stream = BytesIO(content)
    if (version := np.lib.format.read_magic(stream)) != (1, 0):
        raise ValueError(f"array format {version}")
    shape, _, dtype = np.lib.format.read_array_header_1_0(stream)
    if math.prod(shape) * dtype.itemsize != len(content) - stream.tell():
        raise ValueError(f"'{member.filename}' has not the size of its shape {shape}")
    stream.seek(0)
    return np.lib.format.read_array(stream, allow_pickle=False)


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
    """`write_file` for NumPy arrays, and texts as such, in an `.npz` file."""
    content = BytesIO()
    np.savez_compressed(content, **arrays)  # type: ignore[arg-type]
    write_file(file, content.getvalue())


def write_figure(figure: Figure, file: str | Path, dpi: float) -> None:
    """`write_file` for a matplotlib figure, in the format that the file's name ends with; a
    ValueError if matplotlib does not know it."""
    from matplotlib import rc_context

    content, engine = BytesIO(), figure.get_layout_engine()
    if engine is not None:  # else savefig would draw all of it once more, for the layout alone
        engine.execute(figure)
        with rc_context({"figure.autolayout": False, "figure.constrained_layout.use": False}):
            figure.set_layout_engine(None)
    try:
        figure.savefig(content, format=Path(file).suffix[1:] or None, dpi=dpi)
    finally:
        figure.set_layout_engine(engine)
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
