"""Text files as text, block by block: byte-order mark, UTF-8, or the Windows code page where that is certain."""

from __future__ import annotations

import codecs
import hashlib
import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ...errors import InputError

_MARKS = {
    codecs.BOM_UTF8: ("utf-8-sig", "utf-8-sig"),
    codecs.BOM_UTF16_LE: ("utf-16", "utf-16-le"),
    codecs.BOM_UTF16_BE: ("utf-16", "utf-16-be"),
}
_CERTAIN = "°µ²³±äöüÄÖÜßéèàç·".encode("cp1252")
_ALLOWED = bytes(range(0x80)) + _CERTAIN
BLOCK = 1 << 22  # bytes read at once


@dataclass(frozen=True)
class Encoded:
    """How a text file is encoded, found on one pass over all of it.

    Parameters
    ----------
    path : Path
        The text file.
    codec, encoding : str
        Name for Python, and name in reports.
    assumed : bool
        Whether the encoding was concluded from its letters, which is said.
    size : int
        Bytes of it that are read; what a logger appends later is not.
    most_lines : int
        At least as many as it has.
    """

    path: Path
    codec: str
    encoding: str
    assumed: bool
    size: int
    most_lines: int

    def text(self, digest: hashlib._Hash | None = None, block: int = 0) -> Iterator[str]:
        """Text in pieces, without byte-order mark, line ends as "\\n"; the bytes go into the hash on the way.

        Raises
        ------
        InputError
            The file changed while it was read.
        """
        decoder = io.IncrementalNewlineDecoder(codecs.getincrementaldecoder(self.codec)(), translate=True)
        first = True
        try:
            for content, last in _blocks(self.path, self.size, block):
                if digest is not None:
                    digest.update(content)
                piece = decoder.decode(content, final=last)
                yield piece.removeprefix("\ufeff") if first else piece
                first = first and not piece
        except UnicodeDecodeError:
            raise InputError("the file changed while it was read", where=str(self.path)) from None


def examine(path: Path, encoding: str | None = None) -> Encoded:
    """Encoding of a text file.

    Parameters
    ----------
    path : Path
        Text file to read.
    encoding : str, optional
        Encoding declared under [record].

    Raises
    ------
    InputError
        Binary content, or bytes that could be several encodings, with line and byte.
    """
    where, size = str(path), path.stat().st_size
    with path.open("rb") as file:
        head = file.read(4)
    mark = next((m for m in _MARKS if head.startswith(m)), None)
    if encoding is None and mark is not None:
        codec, name = _MARKS[mark]
        return _strict(path, size, codec, name)
    if encoding is not None:
        return _strict(path, size, encoding, encoding)
    place, lines = _undecodable(path, size, "utf-8")
    if place is None:
        return Encoded(path, "utf-8", "utf-8", False, size, lines)
    foreign = _foreign(path, size)
    if foreign is None:
        return Encoded(path, "cp1252", "cp1252", True, size, lines)
    raise InputError(
        f"byte 0x{foreign[1]:02X} (byte {foreign[0]}) is no UTF-8 text, and could be several other letters",
        where=f"{where}, line {_line_of(path, foreign[0])}",
        expected="UTF-8, or a declared encoding",
        remedy='Write encoding = "cp1252" (or what the logger says), or save the file as UTF-8.',
    )


def _strict(path: Path, size: int, codec: str, name: str) -> Encoded:
    place, lines = _undecodable(path, size, codec)
    if place is not None:
        raise InputError(
            f"byte {place} is no {name} text",
            where=f"{path}, line {_line_of(path, place)}",
            expected=f"a file in {name}",
            remedy="Declare another encoding.",
        )
    return Encoded(path, codec, name, False, size, lines)


def _blocks(path: Path, size: int, block: int = 0) -> Iterator[tuple[bytes, bool]]:
    """The first `size` bytes of a file, in blocks, and whether a block is the last."""
    with path.open("rb") as file:
        done = 0
        while done < size:
            content = file.read(min(block or BLOCK, size - done))
            done += len(content)
            yield content, done >= size or not content
            if not content:
                return


def _undecodable(path: Path, size: int, codec: str) -> tuple[int | None, int]:
    """Place of the first byte that is no text in a codec, None without one; and a bound of the number of lines."""
    decoder = codecs.getincrementaldecoder(codec)()
    ascii_like = codec in ("utf-8", "cp1252")
    place, start, feeds, returns = None, 0, 0, 0
    for content, last in _blocks(path, size):
        if b"\0" in content and not codec.lower().replace("_", "-").startswith("utf-16"):
            raise InputError(
                "the file is binary (it holds NUL bytes)",
                where=str(path),
                expected="a text file with columns",
                remedy='UTF-16 without a byte-order mark: declare encoding = "utf-16-le".',
            )
        feeds += content.count(b"\n")
        returns += content.count(b"\r")
        waiting = len(decoder.getstate()[0])
        if place is None and not (ascii_like and not waiting and content.isascii()):
            try:
                decoder.decode(content, final=last)
            except UnicodeDecodeError as error:
                place = start - waiting + error.start
        start += len(content)
    return place, max(feeds, returns) + 1


def _foreign(path: Path, size: int) -> tuple[int, int] | None:
    """Place and value of the first byte that is not certain to be a letter of the Windows code page."""
    start = 0
    for content, _ in _blocks(path, size):
        rest = content.translate(None, _ALLOWED)
        if rest:
            return start + content.index(rest[:1]), rest[0]
        start += len(content)
    return None


def _line_of(path: Path, place: int) -> int:
    return 1 + sum(content.count(b"\n") for content, _ in _blocks(path, place))
