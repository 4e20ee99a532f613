"""The certificate file: claim, exact data, evidence; written whole or not at all, read without trust."""

from __future__ import annotations

import json
import os
import stat
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from robthermal.errors import InputError

from ._fields import get, mapping, text
from ._kinds import KINDS
from ._numbers import name_of, plain_number

FORMAT = "robthermal-certificate/1"
_LARGEST = 200_000_000  # bytes
_MOST_VALUES = 8_000_000
_DEEPEST = 100  # nested objects and lists
_SECTIONS = ("system", "region", "evidence", "margin", "made_by")


@dataclass(frozen=True)
class Certificate:
    """A claim with every number needed to prove it again.

    Parameters
    ----------
    kind : str
        Kind of claim: contraction, invariance, runaway, network, observer, gain, regulated, loop, stability, hinf,
        peak, frequency, closed_loop, polytope, ellipsoid, scheduled or network_peak.
    claim : str
        One sentence, the one its data give.
    system : mapping
        Every number of the physics the claim depends on, SI units.
    region : mapping
        Box of temperatures [K], currents [A] and inputs.
    evidence : mapping
        Weights, matrices and rates that prove the claim.
    margin : mapping
        How much further the same evidence reaches.
    made_by : mapping
        Versions, solver and its status; never used as evidence.
    format : str
        Version of the file format.
    holds : bool
        Whether the claim was proven when the certificate was made. False is an honest answer, not an error.
    reason : str
        Why it does not hold; empty when it does.

    Examples
    --------
    >>> from robthermal.verification import establish
    >>> rod = {"lumps": {"rod": {"capacity": 10.0}}, "ambients": ["room"], "modules": {},
    ...        "links": [{"between": ["rod", "room"], "conductance": 0.5}]}
    >>> box = {"temperature": [250.0, 400.0], "current": {}}
    >>> c = establish("contraction", system=rod, region=box, evidence={"method": "energy", "rate": 0.04}, made_by={})
    >>> c.holds
    True
    """

    kind: str
    claim: str
    system: Mapping[str, Any]
    region: Mapping[str, Any]
    evidence: Mapping[str, Any]
    margin: Mapping[str, Any]
    made_by: Mapping[str, Any]
    format: str = FORMAT
    holds: bool = True
    reason: str = ""

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the certificate as JSON: complete, or not at all.

        Parameters
        ----------
        path : str or path
            File to write; an existing one is replaced in one step.

        Raises
        ------
        InputError
            If the file cannot be written, or the content is not numbers, texts, lists and objects.
        """
        target = Path(path)
        try:
            content = json.dumps(self._document(), indent=1, allow_nan=False, default=_plain).encode()
        except (TypeError, ValueError, RecursionError) as error:
            raise InputError(f"certificate cannot be written: {error}", where=ascii(str(target))) from error
        if len(content) > _LARGEST:
            raise InputError(f"certificate of {len(content)} bytes", where=ascii(str(target)),
                             expected=f"at most {_LARGEST} bytes", remedy="Keep large networks in memory.")
        try:
            _replace(target, content)
        except (OSError, ValueError) as error:
            raise InputError(f"cannot write: {_words(error)}", where=ascii(str(target))) from error

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Certificate:
        """Read a certificate file and check its form; `verify` checks its content.

        Parameters
        ----------
        path : str or path
            File to read.

        Returns
        -------
        Certificate
            Numbers that are no doubles stay decimal text, so that nothing is rounded.

        Raises
        ------
        InputError
            For whatever cannot be read: no file, no JSON, another format or kind, a key given twice,
            NaN, exponents beyond a float, a section or number missing or of another type.
        """
        if not isinstance(path, (str, os.PathLike)):
            raise InputError(f"{name_of(path)} is not a path", where="path", expected="a text or Path")
        where = ascii(os.fspath(path))
        try:
            return cls._from_document(_parse(_read(path)))
        except InputError as error:
            raise InputError(error.what, where=f"{where} {error.where}".strip(), expected=error.expected,
                             remedy=error.remedy) from None

    def check_form(self) -> Any:
        """Return the exact problem of the certificate; InputError where its content is malformed."""
        for section in _SECTIONS:
            mapping(getattr(self, section), section)
        if self.format != FORMAT:
            raise InputError(f"format {name_of(self.format)}", where="format", expected=f"{FORMAT!r}")
        if not isinstance(self.kind, str) or self.kind not in KINDS:
            raise InputError(f"kind {name_of(self.kind)}", where="kind", expected=f"one of {sorted(KINDS)}")
        text(self.claim, "claim")
        if not isinstance(self.holds, bool) or not isinstance(self.reason, str):
            raise InputError("holds is not true or false, or reason is not a text", where="holds, reason")
        if not self.holds:
            return None  # claims nothing: its evidence may be incomplete
        return KINDS[self.kind].read(self.system, self.region, self.evidence, self.margin)

    def __str__(self) -> str:
        if not self.holds:
            return f"{self.kind} certificate, does not hold: {self.reason}\n{self.claim}"
        return f"{self.kind} certificate, claims (not verified here; rt.verify does): {self.claim}"

    def _repr_html_(self) -> str:
        """For notebooks; like `str`, a claim is shown as a claim: only `rt.verify` proves it."""
        return f"<p>{escape(str(self))}</p>".replace("\n", "<br>")

    def _document(self) -> dict[str, Any]:
        return {"format": self.format, "kind": self.kind, "claim": self.claim, "holds": self.holds,
                "reason": self.reason, **{section: getattr(self, section) for section in _SECTIONS}}

    @classmethod
    def _from_document(cls, document: Any) -> Certificate:
        table = mapping(document, "")
        certificate = cls(kind=get(table, "kind", ""), claim=get(table, "claim", ""), format=get(table, "format", ""),
                          holds=table.get("holds", True), reason=table.get("reason", ""),
                          **{section: get(table, section, "") for section in _SECTIONS})
        certificate.check_form()
        return certificate


def _read(path: str | os.PathLike[str]) -> str:
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):  # a pipe or device may never end
            raise InputError("not a regular file", expected="a certificate file")
        with open(path, "rb") as file:
            content = file.read(_LARGEST + 1)
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"cannot read: {_words(error)}", expected="a certificate file") from error
    if len(content) > _LARGEST:
        raise InputError(f"more than {_LARGEST} bytes", expected="a certificate file")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"not UTF-8 text (byte {error.start})", expected="a JSON certificate file") from error


def _parse(content: str) -> Any:
    nodes = sum(map(content.count, ",[{:"))  # at least one stands before every value but the first
    if nodes > _MOST_VALUES:
        raise InputError(f"more than {_MOST_VALUES} values", expected="a certificate file",
                         remedy="Keep large networks in memory.")
    try:
        document = json.loads(content, parse_float=lambda text: plain_number(text, "number"), parse_int=_integer,
                              parse_constant=_no_constant, object_pairs_hook=_no_duplicates)
    except RecursionError as error:
        raise InputError("nested too deeply", expected=f"at most {_DEEPEST} levels") from error
    except json.JSONDecodeError as error:
        raise InputError(f"not JSON: {error.msg} (line {error.lineno}, column {error.colno})") from error
    _check_values(document)
    return document


def _check_values(document: Any) -> None:
    """Refuse deep nesting, and texts that no terminal could print (lone surrogates)."""
    stack = [(document, 1)]
    while stack:
        value, depth = stack.pop()
        if depth > _DEEPEST:
            raise InputError("nested too deeply", expected=f"at most {_DEEPEST} levels")
        if isinstance(value, str) and not value.isascii():
            _check_text(value)
        elif isinstance(value, dict):
            stack.extend((item, depth + 1) for item in (*value, *value.values()))
        elif isinstance(value, list):
            stack.extend((item, depth + 1) for item in value if isinstance(item, (str, dict, list)))


def _check_text(value: str) -> None:
    try:
        value.encode("utf-8")
    except UnicodeEncodeError as error:
        raise InputError(f"text {name_of(value)} is not Unicode") from error


def _integer(value: str) -> int:
    plain_number(value, "number")  # refuses what no float holds, so that int() below stays short
    return int(value)


def _no_constant(name: str) -> Any:
    raise InputError(f"{name} is not a number", expected="finite numbers")


def _no_duplicates(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table: dict[str, Any] = {}
    for key, value in pairs:
        if key in table:
            raise InputError(f"the key {name_of(key)} is given twice in one object")
        table[key] = value
    return table


def _plain(value: Any) -> Any:
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"{type(value).__name__} is not a number, text, list or object")


def _replace(target: Path, content: bytes) -> None:
    handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.", suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            os.fchmod(file.fileno(), 0o644)
        os.replace(name, target)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _words(error: Exception) -> str:
    return error.strerror if isinstance(error, OSError) and error.strerror else str(error)
