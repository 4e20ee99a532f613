"""Files that appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import InputError


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """A file beside `path` to be written; it takes the place of `path` in one step, when nothing was raised.

    Parameters
    ----------
    path : str or Path
        File that will appear, with the permissions of a new file.

    Yields
    ------
    Path
        Empty file in the same folder, with the same ending.

    Raises
    ------
    InputError
        If the folder does not exist or nothing can be written there.

    Examples
    --------
    >>> with whole_file("result.txt") as part:
    ...     _ = part.write_text("done")
    >>> Path("result.txt").read_text(), sorted(file.name for file in Path(".").glob("*result*"))
    ('done', ['result.txt'])
    """
    target = Path(path)
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.stem}.", suffix=target.suffix)
        os.close(handle)
        try:
            yield Path(name)
            os.chmod(name, 0o644)
            os.replace(name, target)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise InputError(f"cannot be written ({error.strerror or error})", where=ascii(str(target)),
                         remedy="Check the folder and its permissions.") from error


def write(path: str | Path, content: bytes) -> None:
    """Write a file whole, or not at all.

    Parameters
    ----------
    path : str or Path
        File to write.
    content : bytes
        What it will hold.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    with whole_file(path) as part:
        part.write_bytes(content)
