"""The one result of every estimator: a frequency response, and how far it can be believed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property, partial
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robthermal._arrays import Array
from robthermal.errors import InputError, Outcome

from .._control import control
from . import _response_files, _response_plots, _response_text
from ._deferred import Deferred, fixed, narrow, part_of, shifted
from ._regions import correlated_blocks, independent_blocks, kronecker, radius_of
from ._response_shapes import PER_BIN, check_shapes


@dataclass(frozen=True, eq=False, init=False, repr=False)
class FrequencyResponse:
    """Estimated frequency response G(j omega) with its uncertainty.

    What is large is computed on first use: `covariance`, `transient`, `coherence`, and of very long records also
    `noise_covariance`. Work on a part with :meth:`between` when the whole would not fit in memory.

    Parameters
    ----------
    frequencies : array_like, shape (n_f,)
        Frequencies of the bins [Hz], increasing.
    response : array_like, shape (n_y, n_u, n_f)
        G [output unit / input unit]; NaN where the data do not determine it.
    noise_covariance : array_like or callable, shape (n_y, n_y, n_f)
        E[V_o V_p*] [output unit squared], DFT normalized by 1/sqrt(N): white noise of standard deviation s gives s^2.
    degrees_of_freedom : array_like, shape (n_f,)
        q of the noise covariance: points used minus rank of the regressors [-].
    covariance : array_like or callable, shape (n_y n_u, n_y n_u, n_f), optional
        E[(vec G^ - vec G)(.)^H] with the columns of G stacked: entry [i n_y + o, j n_y + p] belongs to G_oi and G_pj.
        Either this or `gram` is needed.
    gram : array_like, shape (n_u, n_u, n_f), optional
        Block of (K^H K)^-1 that belongs to G: covariance[i n_y + o, j n_y + p] = gram[i, j] noise_covariance[o, p].
    noise_variance : array_like, shape (n_y, n_f), optional
        Diagonal of the noise covariance, when that is a callable.
    transient : array_like or callable, shape (n_y, n_f), optional
        Transient T at the bins [output unit], of the first record.
    coherence : array_like or callable, shape (n_y, n_f), optional
        Part of the power of each output (transient removed) that the inputs explain [-].
    suspect : array_like of bool, shape (n_f,), optional
        Bins where the result distrusts its own local model.
    nonlinear_covariance : array_like, shape (n_y, n_y, n_f), optional
        Stochastic nonlinear distortion E[Y_S Y_S^H] of one period (`bla`) [output unit squared].
    ratio_uncertainty : array_like, shape (n_y, n_u, n_f), optional
        Relative standard deviation of the divisor when G is a ratio (closed loop) [-]; widens `confidence_radius`.
    input_names, output_names : sequence of str
        Names of the channels.
    sample_time : float
        Sample time of the records [s].
    n_samples : int
        Samples in the longest record [-].
    method : str
        The estimator and its settings, in words.
    half_width : int
        Bins on either side that share data with an estimate [-]; 0 when the bins are independent.
    joint : callable, optional
        For :meth:`joint_covariance`: weights and rows of given bins.
    notes : sequence of str, optional
        What the estimator has to say about this result.
    operating_point : mapping, optional
        Means of the inputs of the records: heaters, module currents [A] and ambients [K], also of inputs that never
        changed and are therefore not among `input_names`. Empty where they are not known.

    Examples
    --------
    >>> import numpy as np
    >>> import robthermal as rt
    >>> rng = np.random.default_rng(0)
    >>> u = rng.normal(size=400)
    >>> record = rt.Record(sample_time=1.0, inputs=u, outputs=2.0 * u + 0.01 * rng.normal(size=400),
    ...                    input_names=["heater"], output_names=["T"])
    >>> G = rt.identify.lpm(record)
    >>> G.response.shape, G.covariance.shape, G.transient.shape
    ((1, 1, 199), (1, 1, 199), (1, 199))
    >>> bool(np.mean(abs(G.response - 2.0) < G.confidence_radius(0.95)) > 0.9)
    True
    """

    frequencies: Array
    response: Array
    degrees_of_freedom: Array
    suspect: Array
    gram: Array | None
    nonlinear_covariance: Array | None
    ratio_uncertainty: Array | None
    input_names: tuple[str, ...]
    output_names: tuple[str, ...]
    sample_time: float
    n_samples: int
    half_width: int
    method: str
    notes: tuple[str, ...]
    operating_point: dict[str, float]
    _covariance: Any
    _noise_covariance: Any
    _noise_variance: Any
    _transient: Any
    _coherence: Any
    _joint: Any

    def __init__(
        self,
        *,
        frequencies: ArrayLike,
        response: ArrayLike,
        noise_covariance: ArrayLike | Deferred,
        degrees_of_freedom: ArrayLike,
        covariance: ArrayLike | Deferred | None = None,
        gram: ArrayLike | None = None,
        noise_variance: ArrayLike | None = None,
        transient: ArrayLike | Deferred | None = None,
        coherence: ArrayLike | Deferred | None = None,
        suspect: ArrayLike | None = None,
        nonlinear_covariance: ArrayLike | None = None,
        ratio_uncertainty: ArrayLike | None = None,
        input_names: Sequence[str],
        output_names: Sequence[str],
        sample_time: float,
        n_samples: int,
        method: str,
        half_width: int = 0,
        joint: Callable[[Array], tuple[Array, Array]] | None = None,
        notes: Sequence[str] = (),
        operating_point: Mapping[str, float] | None = None,
    ):
        count = np.size(frequencies)
        values = {
            "frequencies": fixed(frequencies, float),
            "response": fixed(response, complex),
            "degrees_of_freedom": fixed(degrees_of_freedom, np.asarray(degrees_of_freedom).dtype),
            "suspect": fixed(np.zeros(count, dtype=bool) if suspect is None else suspect, bool),
            "gram": None if gram is None else fixed(gram, complex),
            "nonlinear_covariance": None if nonlinear_covariance is None else fixed(nonlinear_covariance, complex),
            "ratio_uncertainty": None if ratio_uncertainty is None else fixed(ratio_uncertainty, float),
            "input_names": tuple(input_names),
            "output_names": tuple(output_names),
            "sample_time": float(sample_time),
            "n_samples": int(n_samples),
            "half_width": int(half_width),
            "method": method,
            "notes": tuple(notes),
            "operating_point": {str(name): float(mean) for name, mean in (operating_point or {}).items()},
            "_covariance": covariance,
            "_noise_covariance": noise_covariance,
            "_noise_variance": noise_variance,
            "_transient": transient,
            "_coherence": coherence,
            "_joint": joint,
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)  # frozen: this is the one place that writes
        check_shapes(self._arguments())

    @property
    def n_frequencies(self) -> int:
        """Number of frequencies."""
        return int(self.frequencies.size)

    def __len__(self) -> int:
        return self.n_frequencies

    @property
    def has_covariance(self) -> bool:
        """Whether anything is known about the noise; False for responses read from CSV."""
        return bool(np.any(self.degrees_of_freedom > 0) or np.any(np.isfinite(self.variance)))

    @cached_property
    def noise_covariance(self) -> Array:
        """E[V_o V_p*], shape (n_y, n_y, n_f) [output unit squared]."""
        return fixed(part_of(self._noise_covariance, slice(None)), complex)

    @cached_property
    def noise_variance(self) -> Array:
        """Diagonal of the noise covariance, shape (n_y, n_f) [output unit squared]."""
        if self._noise_variance is not None:
            return fixed(self._noise_variance, float)
        return fixed(np.einsum("oof->of", self.noise_covariance).real, float)

    @cached_property
    def covariance(self) -> Array:
        """E[(vec G^ - vec G)(.)^H], columns of G stacked, shape (n_y n_u, n_y n_u, n_f)."""
        if self._covariance is not None:
            return fixed(part_of(self._covariance, slice(None)), complex)
        return fixed(kronecker(np.asarray(self.gram), self.noise_covariance), complex)

    @cached_property
    def transient(self) -> Array:
        """Transient of the first record at the bins, shape (n_y, n_f) [output unit]; NaN if the method has none."""
        if self._transient is None:
            return fixed(np.full((len(self.output_names), self.n_frequencies), np.nan), complex)
        return fixed(part_of(self._transient, slice(None)), complex)

    @cached_property
    def coherence(self) -> Array:
        """Part of each output's power that the inputs explain, shape (n_y, n_f), between 0 and 1."""
        if self._coherence is None:
            return fixed(np.full((len(self.output_names), self.n_frequencies), np.nan), float)
        return fixed(part_of(self._coherence, slice(None)), float)

    @cached_property
    def variance(self) -> Array:
        """E|G^_oi - G_oi|^2, shape (n_y, n_u, n_f): the diagonal of `covariance`, without the rest."""
        if self.gram is not None and self._covariance is None:
            of_inputs = np.diagonal(self.gram).T.real  # (n_u, n_f)
            return fixed(of_inputs[None] * self.noise_variance[:, None], float)
        # A variance that is exactly zero (y and u tied by the controller) may come out negative by rounding.
        diagonal = np.maximum(np.einsum("aaf->af", self.covariance).real, 0.0)
        shape = (len(self.input_names), len(self.output_names), self.n_frequencies)
        return fixed(diagonal.reshape(shape).transpose(1, 0, 2), float)

    def confidence_radius(self, p: float = 0.95) -> Array:
        """Radius of the circle around each entry of G that holds the true value with probability `p`.

        sqrt(F_p(2, 2q) variance); infinite where G is not determined. Where G is a ratio (closed loop) the radius is
        divided by 1 - sqrt(F_p) times the relative uncertainty of the divisor, which contains Fieller's region.

        Parameters
        ----------
        p : float
            Confidence level [-], between 0 and 1.

        Returns
        -------
        numpy.ndarray, shape (n_y, n_u, n_f)
            Radii in the complex plane [unit of G].
        """
        return radius_of(self.variance, self.degrees_of_freedom, self.ratio_uncertainty, p)

    def joint_covariance(self, bins: ArrayLike) -> Array:
        """Covariance of G at several bins together: neighboring estimates share data and are correlated.

        Parameters
        ----------
        bins : array_like of int
            Positions in `frequencies` [-].

        Returns
        -------
        numpy.ndarray, shape (n_y n_u n_b, n_y n_u n_b)
            Hermitian; bins outermost, then as in `covariance`. Bins more than 2 half_width apart share no data, except
            at the ends, where windows are shifted.
        """
        index = np.atleast_1d(np.asarray(bins, dtype=int))
        if self._joint is None:
            return independent_blocks(self.covariance, index)
        noise = np.stack([part_of(self._noise_covariance, slice(b, b + 1))[..., 0] for b in index], axis=-1)
        weights, rows = self._joint(index)
        return correlated_blocks(weights, rows, noise)

    def between(self, low: float, high: float) -> FrequencyResponse:
        """The part from `low` to `high` [Hz], both included.

        Parameters
        ----------
        low, high : float
            Lowest and highest frequency [Hz].

        Returns
        -------
        FrequencyResponse
            The same estimate on fewer bins.
        """
        inside = np.flatnonzero((self.frequencies >= low) & (self.frequencies <= high))
        if not inside.size:
            raise InputError(
                f"no frequency between {low!r} and {high!r} Hz",
                where="low, high",
                expected=f"limits within {self.frequencies[0]:g} ... {self.frequencies[-1]:g} Hz",
            )
        return self._part(slice(int(inside[0]), int(inside[-1]) + 1))

    def _part(self, part: slice) -> FrequencyResponse:
        arguments = self._arguments()
        joint, per_bin = arguments.pop("joint"), [name for name in arguments if name in PER_BIN]
        return FrequencyResponse(**{
            **arguments,
            **{name: narrow(arguments[name], part) for name in per_bin},
            "joint": None if joint is None else partial(shifted, joint, part.start),
        })

    def _arguments(self) -> dict[str, Any]:
        """What the constructor was given."""
        return {field.name.removeprefix("_"): getattr(self, field.name) for field in fields(self)}

    def __getstate__(self) -> dict[str, Any]:
        """For pickling: what was to be computed when asked for is computed now."""
        names = ("noise_covariance", "transient", "coherence", *(() if self._covariance is None else ("covariance",)))
        return {**self.__dict__, **{f"_{name}": getattr(self, name) for name in names}}

    def replace(self, **changes: Any) -> FrequencyResponse:
        """The same estimate with other notes, names, operating point or any other argument of the constructor.

        Parameters
        ----------
        **changes
            New values by the name of the argument.

        Returns
        -------
        FrequencyResponse

        Examples
        --------
        >>> import robthermal as rt
        >>> G = rt.identify.FrequencyResponse(
        ...     frequencies=[0.1], response=[[[2.0]]], noise_covariance=[[[1e-4]]], gram=[[[1.0]]],
        ...     degrees_of_freedom=[8], input_names=["q"], output_names=["T"], sample_time=1.0, n_samples=100,
        ...     method="by hand")
        >>> G.replace(operating_point={"q": 5.0}).operating_point
        {'q': 5.0}
        """
        return FrequencyResponse(**{**self._arguments(), **changes})

    @property
    def outcome(self) -> Outcome:
        """Whether the estimate may be used as it stands; the text says what to distrust and what to do."""
        return _response_text.outcome(self)

    @property
    def remarks(self) -> tuple[Outcome, ...]:
        """What has to stand beside any claim that rests on it: ``constant_input``, ``frf_without_covariance``."""
        return _response_text.remarks(self)

    def to_control(self) -> control.FrequencyResponseData:
        """As a python-control object, at angular frequencies [rad/s], bins that are not determined left out.

        The time base is left open (``dt=None``), so that it combines with continuous-time and sampled models alike.
        """
        good = ~np.isnan(self.response).any(axis=(0, 1))
        return control.FrequencyResponseData(
            self.response[..., good],
            2.0 * np.pi * self.frequencies[good],
            dt=None,
            inputs=list(self.input_names),
            outputs=list(self.output_names),
        )

    def save(self, path: str | PathLike[str]) -> None:
        """Write everything to a file, with the format of its suffix.

        Parameters
        ----------
        path : str or path-like
            ``.json``, ``.mat`` or ``.npz``. Nothing is pickled.
        """
        _response_files.save(self, path)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> FrequencyResponse:
        """Read a file, as :func:`robthermal.identify.read_response`; returns the saved estimate.

        Parameters
        ----------
        path : str or path-like
            File that :meth:`save` wrote, or CSV; the content tells the format.
        """
        return cls(**_response_files.load(path))

    def plot(self, kind: str = "bode", p: float = 0.95) -> NDArray[Any]:
        """Draw the estimate.

        Parameters
        ----------
        kind : {"bode", "coherence", "transient"}
            Magnitude and phase with confidence band, coherence, or transient beside the noise level.
        p : float
            Confidence level of the band [-].

        Returns
        -------
        ndarray of matplotlib axes, (2 n_y, n_u) for "bode" (magnitude above phase), else (n_y,)
        """
        return _response_plots.draw(self, kind, p)

    def __repr__(self) -> str:
        return f"<FrequencyResponse {self.method}, {len(self.output_names)}x{len(self.input_names)}, {len(self)} bins>"

    def __str__(self) -> str:
        return _response_text.table(self)

    def _repr_html_(self) -> str:
        return _response_text.html(self)
