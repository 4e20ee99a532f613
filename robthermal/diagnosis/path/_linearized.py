"""What a fit asks of a model beside its data: one protocol, for records and for frequency responses."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...fitting import Initial, ResponseWhitener
from ...thermal import System
from ..data import DataSet, ResponseData
from ..effects import Candidate, TrialContext
from ._whitening import Whitener

Array = NDArray[np.float64]
White = Whitener | ResponseWhitener


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Unknowns of a fit, as one data set sees them.

    Parameters
    ----------
    v : ndarray, shape (p,)
        Values of all unknowns.
    system : callable
        Unknowns to the system common to all data sets.
    steps : ndarray, shape (n_common,)
        Small steps of the common unknowns, for differences.
    bounds : tuple of ndarray
        Lower and upper bounds of all unknowns.
    names : list of str
        Numbers of the system that depend on the common unknowns.
    chain : ndarray, shape (len(names), n_common)
        Their derivatives by the common unknowns.
    start : slice
        Places of the initial temperatures of this data set.
    initial : Initial
        Their names and prior [K].
    gains : slice
        Places of its session gains.
    gain_names : sequence of str
        Numbers of the system behind the gains.
    gain_sigma : sequence of float
        Standard deviations of the gains [-].
    coarse : slice
        Places of what a finer network would change.
    """

    v: Array
    system: Callable[[Array], System]
    steps: Array
    bounds: tuple[Array, Array]
    names: list[str]
    chain: Array
    start: slice
    initial: Initial
    gains: slice
    gain_names: Sequence[str]
    gain_sigma: Sequence[float]
    coarse: slice


class Linearized(TrialContext, Protocol):
    """A model beside one data set, linearized there."""

    @property
    def one(self) -> DataSet:
        """The data set."""

    @property
    def residual(self) -> Array:
        """Measured − modelled, in the form of `DataSet.readings`."""

    @property
    def in_time(self) -> bool:
        """Whether the data set is a record."""

    def coarse_columns(self, base: System) -> Array:
        """Change of the readings (n, m, k) by every way in which a network may be too coarse; 0 of a response.

        Parameters
        ----------
        base : System
            Network without added effects.
        """

    def refined(self, columns: Array, b: Array) -> Linearized:
        """With what a finer network would change; a frequency response as it is.

        Parameters
        ----------
        columns, b : ndarray
            Changes of the readings (n, m, k), and how large they are (k,).
        """

    def slopes(self, unknowns: Unknowns) -> Array:
        """Derivatives (n, m, p) of the modelled readings by all unknowns.

        Parameters
        ----------
        unknowns : Unknowns
            Where, and what they are.
        """

    def columns(self, trials: Sequence[Candidate]) -> Array:
        """Change of the readings (n, m, k) per unit of size of every trial.

        Parameters
        ----------
        trials : sequence of Candidate
            Effects with trial values.
        """

    def splines(self, lump: int) -> Array:
        """Change of the readings (n, m, k) by a spline of extra heat into one lump.

        Parameters
        ----------
        lump : int
            Place of the lump.
        """

    def white(self, noise: Callable[[Any], tuple[Any, ...]]) -> White:
        """The map that makes the errors of the readings white.

        Parameters
        ----------
        noise : callable
            Gives the noise of a linearized record; a response brings its own.
        """

    def bands(self, z: Array) -> list[str]:
        """Where whitened residuals (n, m) are largest, element by element of a response; nothing for a record.

        Parameters
        ----------
        z : ndarray
            Whitened residuals of the data set.
        """

    def noise_windows(self, block: Array) -> Iterator[tuple[ResponseData, Array]]:
        """Rows (n, k) that share an estimate of the noise; none of a record, whose noise is known.

        Parameters
        ----------
        block : ndarray
            Rows of this data set.
        """

    def draw(self, ax: Any, r: Array) -> None:
        """Draw residuals (n, m).

        Parameters
        ----------
        ax : matplotlib.axes.Axes
            Axes to draw on.
        r : ndarray
            Residuals to draw.
        """
