"""Bytes of a text file as text: byte-order mark, UTF-8, or the Windows code page where that is certain."""

from __future__ import annotations

import codecs
from dataclasses import dataclass

from ...errors import InputError

_MARKS = ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))
_NAMES = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
_CERTAIN = frozenset("°µΩ²³±äöüÄÖÜßéèàç·".replace("Ω", "").encode("cp1252"))
_HEAD = 64 * 1024


@dataclass(frozen=True)
class Decoded:
    """Text of a file.

    Parameters
    ----------
    text : str
        Without byte-order mark, line ends as "\\n".
    encoding : str
        How it was decoded.
    assumed : bool
        Whether the encoding was concluded from its letters, which is said.
    """

    text: str
    encoding: str
    assumed: bool


def decode(content: bytes, where: str, encoding: str | None = None) -> Decoded:
    """Text of a file's bytes.

    Parameters
    ----------
    content : bytes
        The whole file.
    where : str
        File, for messages.
    encoding : str, optional
        Encoding declared under [record].

    Raises
    ------
    InputError
        Binary content, or bytes that could be several encodings, with line and byte.
    """
    mark = next((m for m, _ in _MARKS if content.startswith(m)), None)
    if encoding is None and mark is not None:
        return _as(content, dict(_MARKS)[mark], where, _NAMES[mark])
    if b"\0" in content[:_HEAD] or b"\0" in content:
        if encoding is None or not encoding.lower().replace("_", "-").startswith("utf-16"):
            raise InputError(
                "the file is binary (it holds NUL bytes)",
                where=where,
                expected="a text file with columns",
                remedy='UTF-16 without a byte-order mark: declare encoding = "utf-16-le".',
            )
    if encoding is not None:
        return _as(content, encoding, where, encoding)
    try:
        return Decoded(_lines(content.decode("utf-8")), "utf-8", False)
    except UnicodeDecodeError as error:
        foreign = next((k for k, byte in enumerate(content) if byte >= 0x80 and byte not in _CERTAIN), None)
        if foreign is None:
            return Decoded(_lines(content.decode("cp1252")), "cp1252", True)
        place = foreign if foreign is not None else error.start
        line = content.count(b"\n", 0, place) + 1
        raise InputError(
            f"byte 0x{content[place]:02X} (byte {place}) is no UTF-8 text, and could be several other letters",
            where=f"{where}, line {line}",
            expected="UTF-8, or a declared encoding",
            remedy='Write encoding = "cp1252" (or what the logger says), or save the file as UTF-8.',
        ) from None


def _as(content: bytes, codec: str, where: str, name: str) -> Decoded:
    try:
        return Decoded(_lines(content.decode(codec).removeprefix("\ufeff")), name, False)
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InputError(
            f"byte {error.start} is no {name} text",
            where=f"{where}, line {line}",
            expected=f"a file in {name}",
            remedy="Declare another encoding.",
        ) from None


def _lines(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text
