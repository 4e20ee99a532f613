"""How large a change would have been seen: the smallest that the test accepts nine times in ten."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..._distributions import f_isf, t_isf
from ...errors import Diverged
from ...thermal import System
from ..effects import Candidate
from ..fit import Refit, Whitened, orthonormal
from ._parameter_change import GAIN, NAME
from ._reference import Reference
from ._search import Search, families
from ._yardstick import effective_number, freedom_of, inflation, length_of

_POWER = 0.9
_SMALL = 0.3  # size up to which the derivatives without a change decide
_ROUNDS, _CLOSE = 2, 0.05  # of the search for a size beyond that
_FLAT = 1e-9  # relative size of a direction that counts as none


@dataclass(frozen=True)
class Visible:
    """The smallest change of a parameter that new records would have shown with a chance of 0.9.

    Parameters
    ----------
    where : tuple of str
        The parameter, or parameters that are tied to each other.
    lower, higher : float
        Relative decrease and increase, both positive [-]; infinite where none that is possible would be seen.
    """

    where: tuple[str, ...]
    lower: float
    higher: float

    @property
    def name(self) -> str:
        """The parameter, as the fit table names it."""
        return " = ".join(self.where)


def visible_changes(new: Refit, reference: Reference, found: Search) -> tuple[Visible, ...]:
    """What would have been seen of every parameter of the fit table, and of the gain of every heater and module.

    Parameters
    ----------
    new : Refit
        The new records without any change.
    reference : Reference
        What healthy records show.
    found : Search
        What the search has found; its candidates are those that were tried.
    """
    n, out = len(reference.each), list[Visible]()
    for scores, alpha in families(found.scores):
        family = effective_number(scores.signatures, n)
        for i, candidate in enumerate(scores.candidates):
            if candidate.effect.name != GAIN and candidate.where not in new.structure.ranges.members:
                continue  # neither a parameter nor a gain
            kappa, freedom = inflation(candidate, reference.each, new.n_readings), freedom_of(n)
            seen = math.sqrt(kappa * f_isf(alpha / family, 1, freedom))  # distance that the test asks for, then
            needed = seen + math.sqrt(kappa) * float(t_isf(1.0 - _POWER, freedom))  # that which scatter may take off
            own = length_of(new, scores, i)
            lower, higher = (_smallest(new, candidate, needed, own, sign) for sign in (-1.0, 1.0))
            out.append(Visible(_names(candidate, new.system), abs(lower), higher))
    return tuple(out)


def _names(candidate: Candidate, system: System) -> tuple[str, ...]:
    """The numbers that change: of a heater its gain, of a module or a column that heats nothing that of its drive."""
    if candidate.effect.name == NAME:
        return candidate.where
    return tuple(f"modules.{name}.drive.gain" if name in system.modules else
                 f"inputs.{name}.{'gain' if system.inputs[name].gain else 'drive.gain'}" for name in candidate.where)


def _smallest(new: Refit, candidate: Candidate, needed: float, own: float, sign: float) -> float:
    """Relative change in one direction whose signature is as long as needed; infinite if no possible one is."""
    size = candidate.effect.size
    most = abs(size.lower if sign < 0 else size.upper)
    if own * most <= needed:
        return math.inf
    x = needed / own
    for _ in range(_ROUNDS if x > _SMALL else 0):
        try:
            there = _length_at(new, candidate, sign * min(x, most))
        except Diverged:  # nobody would miss that
            break
        before, x = x, needed / (0.5 * (own + there))
        if abs(x - before) < _CLOSE * x:
            break
    if x >= most:
        return math.inf
    return math.expm1(sign * x) if candidate.effect.name == NAME else sign * x


def _length_at(new: Refit, candidate: Candidate, x: float) -> float:
    """Length of the signature per unit of the size where the change has size x: the readings bend."""
    if candidate.effect.name == NAME:
        structure, v = new.structure, new.v.copy()
        at = structure.ranges.members.index(candidate.where)
        lower, upper = structure.bounds
        v[at] = np.clip(v[at] + x, lower[at], upper[at])
        J = Whitened(structure, new.whiteners).slopes(v)
        column = np.concatenate([J[:new.n_readings, at], np.zeros(len(J) - new.n_readings)])
    else:
        structure = new.structure.with_effect(candidate)
        values = [*new.structure.quantities(new.v), {**candidate.shape, candidate.effect.size.name: x}]
        J = Whitened(structure, new.whiteners).slopes(structure.carried(new.structure, new.v, values))
        at = structure.column_of(len(structure.effects) - 1)
        column, J = J[:, at], np.delete(J, at, axis=1)
    basis = orthonormal(J, _FLAT)
    return float(np.linalg.norm(column - basis @ (basis.T @ column)))
