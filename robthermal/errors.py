"""Errors and outcomes: every room speaks to the user through these three classes."""

from __future__ import annotations

from dataclasses import dataclass


class RobthermalError(Exception):
    """Base class of every error this package raises on purpose."""


class InputError(RobthermalError, ValueError):
    """Bad input: one message that says what, where, what was expected and what to do.

    Parameters
    ----------
    what : str
        What is wrong, with the offending value.
    where : str, optional
        File, table, row or argument in which it was found.
    expected : str, optional
        What would have been accepted.
    remedy : str, optional
        What the user can do about it.

    Examples
    --------
    >>> raise InputError("capacity is -3 J/K", where="setup.toml [lumps.x1]",
    ...                  expected="a positive number", remedy="Check the sign.")
    Traceback (most recent call last):
    ...
    robthermal.errors.InputError: setup.toml [lumps.x1]: capacity is -3 J/K. Expected a positive number. Check the sign.
    """

    def __init__(self, what: str, *, where: str = "", expected: str = "", remedy: str = ""):
        self.what, self.where, self.expected, self.remedy = what, where, expected, remedy
        message = f"{where}: {what}" if where else what
        message = message.rstrip(".")
        if expected:
            message += f". Expected {expected}".rstrip(".")
        message += "."
        if remedy:
            message += f" {remedy}"
        super().__init__(message)


class Diverged(RobthermalError):
    """A simulation left every sensible temperature: the model runs away.

    Parameters
    ----------
    message : str
        What ran away, and what to do.
    time : float
        Time at which it was stopped [s].
    """

    def __init__(self, message: str, *, time: float):
        self.time = time
        super().__init__(message)


@dataclass(frozen=True)
class Outcome:
    """How a computation ended; the text is the remedy.

    Parameters
    ----------
    ok : bool
        Whether the result is what was asked for.
    code : str
        One lower-case word for scripts, for example ``"converged"`` or ``"not_certified"``.
    text : str
        What happened, the likely cause, and what to do next.
    """

    ok: bool
    code: str
    text: str

    def __str__(self) -> str:
        return self.text

    def __bool__(self) -> bool:
        return self.ok
