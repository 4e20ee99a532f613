"""Functions of frequency that a plant is locally a combination of: fractional poles, diffusion, or the user's own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from robthermal._arrays import Array
from robthermal.errors import InputError

from .._checks import excerpt, positive_number, quoted

_FAR_FACES = ("infinite", "held", "insulated")
_EXPECTED = ("'diffusion', 'diffusion:held:TAU', 'diffusion:insulated:TAU', 'fractional:CORNER:ORDER', a Diffusion, a "
             "FractionalPole, a callable of frequencies [Hz], or a list of these")
_DEPENDENT = 1e-4  # part of a function that the others must leave: less is below what any measurement tells apart


@dataclass(frozen=True)
class FractionalPole:
    """Local function 1/((s/w)^order + 1): an ordinary pole for order 1, half an order per decade for order 0.5.

    Parameters
    ----------
    corner : float
        Frequency w where the function begins to fall [rad/s].
    order : float
        Fractional order, above 0 and below 2 [-].

    Raises
    ------
    InputError
        For a corner that is not positive, or an order outside its range.

    Examples
    --------
    >>> import numpy as np
    >>> import robthermal as rt
    >>> half = rt.identify.FractionalPole(0.01, 0.5)
    >>> bool(abs(half(np.array([1e-9]))[0] - 1.0) < 1e-2)
    True
    """

    corner: float
    order: float = 0.5

    def __post_init__(self) -> None:
        positive_number(self.corner, "corner of a FractionalPole", "rad/s")
        if positive_number(self.order, "order of a FractionalPole") >= 2.0:
            raise InputError(f"order is {self.order:g}, which is not stable", where="FractionalPole",
                             expected="a number above 0 and below 2")

    def __call__(self, frequencies: Array) -> Array:
        s = 2j * np.pi * np.asarray(frequencies)
        return np.asarray(1.0 / ((s / self.corner) ** self.order + 1.0))

    def __str__(self) -> str:
        return f"fractional:{self.corner:.6g}:{self.order:.6g}"


@dataclass(frozen=True)
class Diffusion:
    """Local function of a face that takes heat, diffusing into the body behind it, with q = sqrt(s tau).

    Its far face is at infinity, 1/sqrt(s); held at a constant temperature, tanh(q)/q; or insulated, coth(q)/q.

    Parameters
    ----------
    far_face : str
        What the far face does: "infinite", "held" or "insulated".
    time_constant : float, optional
        tau = L^2/a, thickness squared over diffusivity [s]; none for "infinite".

    Raises
    ------
    InputError
        For another word, and for a time constant that is missing, not positive, or given of an infinite body.

    References
    ----------
    Carslaw and Jaeger (1959), Conduction of Heat in Solids, Sec. 3.10 and 12.4.

    Examples
    --------
    >>> import numpy as np
    >>> import robthermal as rt
    >>> slab = rt.identify.Diffusion("held", 500.0)
    >>> bool(abs(slab(np.array([1e-9]))[0] - 1.0) < 1e-5)
    True
    """

    far_face: str = "infinite"
    time_constant: float | None = None

    def __post_init__(self) -> None:
        if self.far_face not in _FAR_FACES:
            raise InputError(f"far_face is {quoted(self.far_face)}", where="Diffusion",
                             expected='"infinite", "held" or "insulated"')
        if self.far_face != "infinite":
            positive_number(self.time_constant, "time_constant of a Diffusion", "s")
        elif self.time_constant is not None:
            raise InputError(f"time_constant is {quoted(self.time_constant)}, of an infinite body", where="Diffusion",
                             expected="none", remedy='Leave it out, or say "held" or "insulated".')

    def __call__(self, frequencies: Array) -> Array:
        q = np.sqrt(2j * np.pi * np.asarray(frequencies) * (self.time_constant or 1.0))
        if self.far_face == "infinite":
            return np.asarray(1.0 / q)
        return np.asarray(np.tanh(q) / q if self.far_face == "held" else 1.0 / (np.tanh(q) * q))

    def __str__(self) -> str:
        return "diffusion" if self.time_constant is None else f"diffusion:{self.far_face}:{self.time_constant:.6g}"


@dataclass(frozen=True)
class LocalFunctions:
    """Checked functions of a local model, each with the name under which messages speak of it."""

    members: tuple[tuple[str, Callable[[Array], Any]], ...]

    @property
    def text(self) -> str:
        """All names, for the method of an estimate."""
        return ", ".join(name for name, _ in self.members)

    def __call__(self, frequencies: Array) -> tuple[Array, tuple[str, ...]]:
        """Values (n_f, n) at positive frequencies [Hz], and a name for every column."""
        columns: list[Array] = []
        names: list[str] = []
        for name, function in self.members:
            rows = _evaluated(name, function, frequencies)
            columns += list(rows)
            names += [name if len(rows) == 1 else f"{name}[{row}]" for row in range(len(rows))]
        return np.stack(columns, axis=1), tuple(names)


def local_functions(basis: Any) -> LocalFunctions:
    """Functions from their texts, objects and callables, one or several."""
    several = basis if isinstance(basis, Sequence) and not isinstance(basis, str) else (basis,)
    if not several:
        raise InputError("no function is given", where="basis", expected=_EXPECTED)
    members = [_member(one, f"basis[{place}]") for place, one in enumerate(several)]
    return LocalFunctions(tuple((name, function) for name, function in members))


def _member(one: Any, where: str) -> tuple[str, Callable[[Array], Any]]:
    if isinstance(one, str):
        one = _from_text(one, where)
    if isinstance(one, FractionalPole | Diffusion):
        return str(one), one
    if not callable(one):
        raise InputError(f"got {quoted(one)}", where=where, expected=_EXPECTED)
    name = getattr(one, "__name__", type(one).__name__)
    return (where if name == "<lambda>" else str(name)), one


def _from_text(text: str, where: str) -> FractionalPole | Diffusion:
    kind, *words = text.strip().split(":")
    try:
        if kind == "fractional" and len(words) in (1, 2):
            return FractionalPole(*(float(word) for word in words))
        if kind == "diffusion" and len(words) in (0, 2):
            return Diffusion(words[0], float(words[1])) if words else Diffusion()
    except ValueError as error:  # an InputError is one too, and says what is wrong
        if isinstance(error, InputError):
            raise InputError(error.what, where=f"{where} {quoted(text)}", expected=error.expected,
                             remedy=error.remedy) from error
    raise InputError(f"got {quoted(text)}", where=where, expected=_EXPECTED)


def _evaluated(name: str, function: Callable[[Array], Any], frequencies: Array) -> Array:
    """Rows (n, n_f) of one function; refuses what is no finite number of that shape."""
    try:
        with np.errstate(all="ignore"):
            values = np.asarray(function(frequencies.copy()))
    except Exception as error:  # the user's own code: anything may happen in it
        raise InputError(f"{name} raised {type(error).__name__}: {excerpt(error)}", where="basis",
                         expected="a function of an array of frequencies [Hz]") from error
    rows = values[None] if values.ndim == 1 else values
    if rows.ndim != 2 or not len(rows) or rows.shape[1] != frequencies.size or rows.dtype.kind not in "iufc":
        raise InputError(f"{name} returned {rows.dtype} of shape {values.shape} for {frequencies.size} frequencies",
                         where="basis", expected=f"numbers of shape ({frequencies.size},) or (n, {frequencies.size})")
    wrong = ~np.isfinite(rows).all(axis=0)
    if wrong.any():
        raise InputError(f"{name} is not finite at {frequencies[wrong][0]:.6g} Hz", where="basis",
                         expected="finite numbers at every positive frequency of the record")
    return rows.astype(complex)


def check_independent(values: Array, names: Sequence[str], frequencies: Array) -> None:
    """Refuse a function that is, over all frequencies, a combination of the constant and the functions before it."""
    span = np.full((len(values), 1), 1.0 / np.sqrt(len(values)), dtype=complex)
    for place, name in enumerate(names):
        largest = float(np.abs(values[:, place]).max())
        column = values[:, place] / (largest or 1.0)
        size, left = np.linalg.norm(column), column
        for _ in range(2):  # once more: orthogonal to rounding
            left = left - span @ (span.conj().T @ left)
        if np.linalg.norm(left) <= _DEPENDENT * size:
            among = " and ".join(["the constant", *names[:place]])
            raise InputError(
                f"{name} is within {_DEPENDENT:g} of a combination of {among} at the frequencies of the record, "
                f"{frequencies[0]:.3g} to {frequencies[-1]:.3g} Hz",
                where="basis",
                expected="functions that differ within that range",
                remedy="Leave it out: the data cannot tell them apart.",
            )
        span = np.column_stack([span, left / np.linalg.norm(left)])
