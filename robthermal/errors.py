"""Errors and outcomes: every package speaks to the user through these classes."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


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

    @classmethod
    def restored(cls, ok: bool, code: str, text: str) -> Outcome:
        """The outcome that a result was saved with.

        Parameters
        ----------
        ok : bool
            Whether the result was what was asked for.
        code : str
            Its word for scripts.
        text : str
            What was said of it.

        Returns
        -------
        Outcome
        """
        return cls(ok, code, text)

    def __str__(self) -> str:
        return self.text

    def __bool__(self) -> bool:
        return self.ok


class OutcomeCode(Enum):
    """Codes of the outcomes of one package, a closed set: each package has one such enum, ``explain`` reads them all.

    A member is ``CODE = (ok, meaning, remedy)``: whether the result is what was asked for (None if each result says so
    itself), what the code means, and what to do about it. Its name in lower case is `Outcome.code`.

    Examples
    --------
    >>> class BatteryCode(OutcomeCode):
    ...     FULL = (True, "The battery is full.")
    ...     EMPTY = (False, "The battery is empty.", "Charge it.")
    >>> print(BatteryCode.EMPTY.outcome())
    The battery is empty. Charge it.
    >>> BatteryCode.EMPTY.outcome("The battery is at 3 %:")
    Outcome(ok=False, code='empty', text='The battery is at 3 %: charge it.')
    """

    def __init__(self, ok: bool | None, meaning: str, remedy: str = "") -> None:
        self.ok = ok
        self.meaning = meaning
        self.remedy = remedy

    @property
    def code(self) -> str:
        """As it stands in `Outcome.code` and in files."""
        return self.name.lower()

    def outcome(self, happened: str = "", *, remedy: str | None = None, ok: bool | None = None) -> Outcome:
        """One computation that ended so.

        Parameters
        ----------
        happened : str, optional
            What happened, with the numbers of this result; the meaning of the code if left out. After a colon the
            remedy goes on with a small letter.
        remedy : str, optional
            What to do about this result, where it is not the remedy of the code; "" if `happened` says it already.
        ok : bool, optional
            Whether the result is what was asked for, of a code that leaves it to the result.

        Returns
        -------
        Outcome

        Raises
        ------
        InputError
            `ok` is given although the code says it, or left out although it does not.
        """
        if (ok is None) == (self.ok is None):
            raise InputError(f"ok is {ok!r}, that of the code {self.ok!r}", where=f"{self}.outcome",
                             expected="exactly one of them to be None")
        said, advice = happened or self.meaning, self.remedy if remedy is None else remedy
        if said.endswith(":"):
            advice = advice[:1].lower() + advice[1:]
        return Outcome(bool(self.ok if ok is None else ok), self.code, f"{said} {advice}".strip())
