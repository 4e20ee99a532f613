"""Exact aliases: effects that change every reading in the same way, each with bounds of its own."""

from __future__ import annotations

from dataclasses import dataclass

from ..effects import Candidate


@dataclass(frozen=True)
class Twin:
    """An effect with the signature of another one: an exact alias of it.

    Parameters
    ----------
    candidate : Candidate
        Effect that is the alias, with its trial values.
    per : float
        Its size per size of the other one, with the sign.
    std : float
        Standard deviation of its size.
    possible : bool
        Whether its size is physically possible where the signatures were computed.
    """

    candidate: Candidate
    per: float
    std: float
    possible: bool

    def possible_beside(self, size: float) -> bool:
        """Whether its own size is physically possible, there or where that of the other one is so large.

        A linearization far from the truth may give it the wrong sign, and so may a refit that ends at a bound.

        Parameters
        ----------
        size : float
            Of the other one, in its unit.
        """
        return self.possible or possible_size(self.candidate, self.per * size, self.std)


def possible_size(trial: Candidate, size: float, std: float) -> bool:
    """Whether a size is within the physical bounds, give or take two standard deviations.

    Parameters
    ----------
    trial : Candidate
        Effect with its bounds.
    size, std : float
        Estimate and its standard deviation, in the unit of the effect.
    """
    bounds = trial.effect.size
    return bounds.lower - 2 * std < size < bounds.upper + 2 * std and (size != 0)
