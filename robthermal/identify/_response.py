"""The one result of every estimator: a frequency response, and how far it can be believed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from os import PathLike
from typing import Any

import control
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from robthermal.errors import InputError, Outcome

from . import _response_files, _response_plots

Array = NDArray[Any]
Deferred = Callable[[slice], Array]  # the values of the bins in a slice, computed when they are asked for


class FrequencyResponse:
    """Estimated frequency response G(j omega) with its uncertainty.

    What is large is computed on first use: `covariance`, `transient`, `coherence`, and `noise_covariance` of very long
    records. Work on a part with :meth:`between` when the whole would not fit in memory.

    Parameters
    ----------
    frequencies : array_like, shape (n_f,)
        Frequencies [Hz], increasing.
    response : array_like, shape (n_y, n_u, n_f)
        G [output unit / input unit]; NaN where the data do not determine it.
    noise_covariance : array_like or callable, shape (n_y, n_y, n_f)
        E[V_o V_p*] [output unit squared], DFT normalised by 1/sqrt(N): white noise of standard deviation s gives s^2.
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
    ratio_uncertainty : array_like, shape (n_y, n_u, n_f), optional
        Relative standard deviation of the divisor when G is a ratio (closed loop) [-]; widens `confidence_radius`.
    input_names, output_names : sequence of str
        Names of the channels.
    sample_time : float
        Sample time [s].
    n_samples : int
        Samples in the (longest) record [-].
    method : str
        The estimator and its settings, in words.
    half_width : int
        Bins on either side that share data with an estimate [-]; 0 when the bins are independent.
    joint : callable, optional
        For :meth:`joint_covariance`: weights and rows of given bins.
    notes : sequence of str, optional
        What the estimator has to say about this result.

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
        ratio_uncertainty: ArrayLike | None = None,
        input_names: Sequence[str],
        output_names: Sequence[str],
        sample_time: float,
        n_samples: int,
        method: str,
        half_width: int = 0,
        joint: Callable[[Array], tuple[Array, Array]] | None = None,
        notes: Sequence[str] = (),
    ):
        self.frequencies = _fixed(frequencies, float)
        self.response = _fixed(response, complex)
        self.degrees_of_freedom = _fixed(degrees_of_freedom, np.asarray(degrees_of_freedom).dtype)
        self.suspect = _fixed(np.zeros(self.n_frequencies, bool) if suspect is None else suspect, bool)
        self.gram = None if gram is None else _fixed(gram, complex)
        self.ratio_uncertainty = None if ratio_uncertainty is None else _fixed(ratio_uncertainty, float)
        self.input_names, self.output_names = tuple(input_names), tuple(output_names)
        self.sample_time, self.n_samples, self.half_width = float(sample_time), int(n_samples), int(half_width)
        self.method, self.notes = method, tuple(notes)
        self._covariance, self._noise, self._joint = covariance, noise_covariance, joint
        self._variance, self._transient, self._coherence = noise_variance, transient, coherence
        self._check_shapes()

    def _check_shapes(self) -> None:
        n_y, n_u, n_f = len(self.output_names), len(self.input_names), self.n_frequencies
        if self._covariance is None and self.gram is None:
            raise InputError("neither covariance nor gram is given", where="covariance")
        wanted: list[tuple[str, Any, tuple[int, ...]]] = [
            ("response", self.response, (n_y, n_u, n_f)),
            ("degrees_of_freedom", self.degrees_of_freedom, (n_f,)),
            ("suspect", self.suspect, (n_f,)),
            ("gram", self.gram, (n_u, n_u, n_f)),
            ("covariance", self._covariance, (n_y * n_u, n_y * n_u, n_f)),
            ("noise_covariance", self._noise, (n_y, n_y, n_f)),
            ("transient", self._transient, (n_y, n_f)),
            ("coherence", self._coherence, (n_y, n_f)),
        ]
        for name, value, shape in wanted:
            if value is not None and not callable(value) and np.shape(value) != shape:
                raise InputError(f"{name} has shape {np.shape(value)}", where=name, expected=f"shape {shape}")

    @property
    def n_frequencies(self) -> int:
        """Number of frequencies."""
        return int(self.frequencies.size)

    def __len__(self) -> int:
        return self.n_frequencies

    @cached_property
    def noise_covariance(self) -> Array:
        """E[V_o V_p*], shape (n_y, n_y, n_f) [output unit squared]."""
        return _fixed(self._part(self._noise, slice(None)), complex)

    @cached_property
    def noise_variance(self) -> Array:
        """Diagonal of the noise covariance, shape (n_y, n_f) [output unit squared]."""
        if self._variance is not None:
            return _fixed(self._variance, float)
        return _fixed(np.einsum("oof->of", self.noise_covariance).real, float)

    @cached_property
    def covariance(self) -> Array:
        """E[(vec G^ - vec G)(.)^H], columns of G stacked, shape (n_y n_u, n_y n_u, n_f)."""
        if self._covariance is not None:
            return _fixed(self._part(self._covariance, slice(None)), complex)
        n = len(self.input_names) * len(self.output_names)
        # Evers (4.16): the Kronecker product puts the input index outside, the output index inside.
        product = np.einsum("ijf,opf->iojpf", self.gram, self.noise_covariance)
        return _fixed(product.reshape(n, n, -1), complex)

    @cached_property
    def transient(self) -> Array:
        """Transient of the first record at the bins, shape (n_y, n_f) [output unit]; NaN if the method has none."""
        if self._transient is None:
            return _fixed(np.full((len(self.output_names), self.n_frequencies), np.nan), complex)
        return _fixed(self._part(self._transient, slice(None)), complex)

    @cached_property
    def coherence(self) -> Array:
        """Part of each output's power that the inputs explain, shape (n_y, n_f), between 0 and 1."""
        if self._coherence is None:
            return _fixed(np.full((len(self.output_names), self.n_frequencies), np.nan), float)
        return _fixed(self._part(self._coherence, slice(None)), float)

    def _part(self, values: Any, bins: slice) -> Array:
        found = values(bins) if callable(values) else np.asarray(values)[..., bins]
        return np.asarray(found)

    @cached_property
    def variance(self) -> Array:
        """E|G^_oi - G_oi|^2, shape (n_y, n_u, n_f): the diagonal of `covariance`, without the rest."""
        if self._covariance is None and self.gram is not None:
            return _fixed(np.einsum("iif->if", self.gram).real[None] * self.noise_variance[:, None], float)
        diagonal = np.einsum("aaf->af", self.covariance).real
        shape = (len(self.input_names), len(self.output_names), self.n_frequencies)
        return _fixed(diagonal.reshape(shape).transpose(1, 0, 2), float)

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
        factor = _quantile(p, self.degrees_of_freedom)
        with np.errstate(invalid="ignore", divide="ignore"):
            radius = np.sqrt(factor * self.variance)
            if self.ratio_uncertainty is not None:
                left = 1.0 - np.sqrt(factor) * self.ratio_uncertainty
                radius = np.where(left > 0.0, radius / left, np.inf)
        return np.where(np.isnan(radius), np.inf, radius)

    def joint_covariance(self, bins: ArrayLike) -> Array:
        """Covariance of G at several bins together: neighbouring estimates share data and are correlated.

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
        n_y, n_u, n_b = len(self.output_names), len(self.input_names), index.size
        block = n_y * n_u
        if self._joint is None:
            joint = np.zeros((n_b, block, n_b, block), dtype=complex)
            for place, b in enumerate(index):
                joint[place, :, place] = self.covariance[..., b]
            return joint.reshape(n_b * block, n_b * block)
        weights, rows = self._joint(index)
        flat = _on_common_rows(weights, rows)  # (n_b n_u, all rows)
        shared = (flat @ flat.conj().T).reshape(n_b, n_u, n_b, n_u)
        noise = np.stack([self._part(self._noise, slice(b, b + 1))[..., 0] for b in index], axis=-1)
        mean = 0.5 * (noise[..., :, None] + noise[..., None, :])  # the noise level may differ a little between the two
        joint = np.einsum("aibj,opab->aiobjp", shared, mean)
        return joint.reshape(n_b * block, n_b * block)

    def between(self, low: float, high: float) -> FrequencyResponse:
        """The part from `low` to `high` [Hz], both included.

        Parameters
        ----------
        low, high : float
            Frequencies [Hz].

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
        part, first = slice(int(inside[0]), int(inside[-1]) + 1), int(inside[0])
        joint = self._joint
        return FrequencyResponse(
            frequencies=self.frequencies[part],
            response=self.response[..., part],
            noise_covariance=_narrow(self._noise, part),
            degrees_of_freedom=self.degrees_of_freedom[part],
            covariance=_narrow(self._covariance, part),
            gram=None if self.gram is None else self.gram[..., part],
            noise_variance=None if self._variance is None else np.asarray(self._variance)[..., part],
            transient=_narrow(self._transient, part),
            coherence=_narrow(self._coherence, part),
            suspect=self.suspect[part],
            ratio_uncertainty=None if self.ratio_uncertainty is None else self.ratio_uncertainty[..., part],
            input_names=self.input_names,
            output_names=self.output_names,
            sample_time=self.sample_time,
            n_samples=self.n_samples,
            method=self.method,
            half_width=self.half_width,
            joint=None if joint is None else lambda index: joint(np.asarray(index) + first),
            notes=self.notes,
        )

    @property
    def outcome(self) -> Outcome:
        """Whether the estimate may be used as it stands; the text says what to distrust and what to do."""
        undetermined = np.isnan(self.response).any(axis=(0, 1))
        if undetermined.any():
            text = f"{int(undetermined.sum())} of {len(self)} bins are not determined by the data (NaN). "
            return Outcome(False, "undetermined", text + " ".join(self.notes))
        if self.suspect.any():
            where = self.frequencies[self.suspect]
            text = (
                f"{where.size} of {len(self)} bins are suspect, from {where[0]:.3g} to {where[-1]:.3g} Hz: the local "
                "model does not describe the window (wider than the slowest pole, or wrong poles), or the loop hides "
                "the plant. Prescribe the slow poles (lrmp), record longer, or leave these bins out."
            )
            return Outcome(False, "suspect", " ".join([text, *self.notes]))
        return Outcome(True, "estimated", " ".join([f"All {len(self)} bins estimated.", *self.notes]))

    def to_control(self) -> control.FrequencyResponseData:
        """As a python-control object, bins that are not determined left out.

        Returns
        -------
        control.FrequencyResponseData
            Response at angular frequencies [rad/s]; the time base is left open (``dt=None``), so that it combines with
            continuous-time and sampled models alike.
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
        """Read what :meth:`save` wrote.

        Parameters
        ----------
        path : str or path-like
            ``.json``, ``.mat`` or ``.npz``.

        Returns
        -------
        FrequencyResponse
            The saved estimate; correlation between bins is kept as uncorrelated beyond the covariance of each bin.
        """
        return cls(**_response_files.load(path))

    def plot(self, kind: str = "bode", p: float = 0.95) -> Any:
        """Draw the estimate.

        Parameters
        ----------
        kind : {"bode", "coherence", "transient"}
            Magnitude and phase with confidence band, coherence of each output, or transient beside the noise level.
        p : float
            Confidence level of the band [-].

        Returns
        -------
        numpy.ndarray of matplotlib axes
            For "bode" of shape (2 n_y, n_u), magnitude above phase; otherwise (n_y,).
        """
        return _response_plots.draw(self, kind, p)

    def __repr__(self) -> str:
        return f"<FrequencyResponse {self.method}, {len(self.output_names)}x{len(self.input_names)}, {len(self)} bins>"

    def __str__(self) -> str:
        lines = [
            f"Frequency response by {self.method}: {len(self)} bins, "
            f"{self.frequencies[0]:.4g} to {self.frequencies[-1]:.4g} Hz",
            f"{'output':<14}{'input':<14}{'f [Hz]':>12}{'|G|':>12}{'phase [deg]':>13}{'radius 95 %':>13}  suspect",
        ]
        radius = self.confidence_radius(0.95)
        chosen = np.unique(np.geomspace(1, len(self), 4).astype(int) - 1)
        for o, output in enumerate(self.output_names):
            for i, name in enumerate(self.input_names):
                for f in chosen:
                    g = self.response[o, i, f]
                    numbers = f"{self.frequencies[f]:>12.4g}{abs(g):>12.4g}{np.degrees(np.angle(g)):>13.1f}"
                    doubt = "yes" if self.suspect[f] else "no"
                    lines.append(f"{output:<14}{name:<14}{numbers}{radius[o, i, f]:>13.3g}  {doubt}")
        return "\n".join([*lines, str(self.outcome)])


def _fixed(values: Any, kind: Any) -> Array:
    """Read-only view: a result is not edited after the fact."""
    array = np.asarray(values, dtype=kind).view()
    array.flags.writeable = False
    return array


def _narrow(values: Any, part: slice) -> Any:
    """The bins of `part` of an array, or of a deferred computation."""
    if values is None:
        return None
    if not callable(values):
        return np.asarray(values)[..., part]
    count = part.stop - part.start

    def inner(bins: slice) -> Array:
        start, stop, step = bins.indices(count)
        return np.asarray(values(slice(part.start + start, part.start + max(stop, start), step)))

    return inner


def _quantile(p: float, q: Array) -> Array:
    """F_p(2, 2q); infinite where no degrees of freedom are left."""
    if isinstance(p, (bool, str)) or not np.isscalar(p) or not 0.0 < float(p) < 1.0:
        raise InputError(f"the confidence level p is {p!r}", where="p", expected="a number between 0 and 1, as 0.95")
    q = np.asarray(q, dtype=float)
    values, place = np.unique(q, return_inverse=True)
    quantiles = np.array([stats.f.ppf(p, 2, 2 * v) if v > 0 else np.inf for v in values])
    return quantiles[place]


def _on_common_rows(weights: Array, rows: Array) -> Array:
    """Weights (n_u, m, B) of rows numbered (B, m), spread over the union of all rows: (B n_u, n_rows)."""
    labels, place = np.unique(rows, return_inverse=True)
    place = place.reshape(rows.shape)
    n_u, _, n_b = weights.shape
    flat = np.zeros((n_b, n_u, labels.size), dtype=complex)
    for b in range(n_b):
        flat[b][:, place[b]] = weights[..., b]
    return flat.reshape(n_b * n_u, labels.size)
