"""The least-squares problem on a frequency response: the linearized model against it, weighted by its covariance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .._arrays import Floats
from .._residual import residual
from ..fitting import MeasuredResponse, Ranges, as_complex
from ..thermal import System
from ._covariance import Share

_DIFFERENCE = 1e-4  # step of the central differences, in `Ranges.spread`; their error is the square of it
_CHUNK = 100  # bins whose correlation with their neighbors is computed at once
_ZERO = 1e-10  # relative eigenvalue that is rounding


@dataclass(frozen=True, eq=False)
class ResponseProblem:
    """Weighted misfit (2.12) of the model to one response, in the coordinates of the parameters.

    Parameters
    ----------
    system : System
        System whose parameters are estimated.
    one : MeasuredResponse
        What of the response is fitted, and the whitener of the errors of every bin.
    ranges : Ranges
        Parameters to estimate.
    scale : float
        What the residuals z, whitened bin by bin, are multiplied with.
    combinations : ndarray, shape (k, 2 n_b m), optional
        Instead of z itself: M^(-1/2) Jᵀ, what is multiplied with z.
    """

    system: System
    one: MeasuredResponse
    ranges: Ranges
    scale: float = 1.0
    combinations: Floats | None = None

    @property
    def size(self) -> int:
        """Number of residuals."""
        return self.one.readings.size if self.combinations is None else len(self.combinations)

    def weighed(self, q: Floats, *, combined: bool) -> ResponseProblem:
        """The same, weighed so that it counts for as much as it knows.

        Bins of a local method share data: the sum of squares of z claims to know more than the response does, H instead
        of H M⁻¹ H. Times the mean eigenvalue of H M⁻¹ it may stand beside other data. The combinations Jᵀz, which alone
        say where its minimum is, whitened by their covariance M, count for H M⁻¹ H in every direction.
        """
        J = self._jacobian(q)
        root = _inverse_root(self._spread_of_score(J))
        if combined:
            return replace(self, combinations=root @ J.T)
        known = float(np.sum((J @ root.T) ** 2)) / len(root)
        return replace(self, scale=min(np.sqrt(known), 1.0))

    def vector(self, q: Floats) -> Floats:
        """Weighted residuals, measured − modelled."""
        return self._weighted(self._whitened(q))

    def jacobian(self, q: Floats) -> Floats:
        """Derivative of `vector`, (size, p)."""
        return self._weighted(self._jacobian(q))

    def share(self, q: Floats) -> Share:
        """What the response says about the coordinates: H and M as they are, or both H M⁻¹ H of the combinations."""
        J, misfit = self._jacobian(q), float(np.mean(self._whitened(q) ** 2))
        H, M = J.T @ J, self._spread_of_score(J)
        if self.combinations is not None:
            own = _inverse_root(M) @ H
            H = M = own.T @ own
        return Share(H, M, self._independent(), max(misfit, 1.0))

    def _model(self, q: Floats) -> Floats:
        return self.one.model(self.system.with_parameters(self.ranges.assigned(self.ranges.values(q))))

    def _whitened(self, q: Floats) -> Floats:
        return self.one.white(residual(self.one.readings, self._model(q))).ravel()

    def _weighted(self, z: Floats) -> Floats:
        return self.scale * z if self.combinations is None else self.combinations @ z

    def _jacobian(self, q: Floats) -> Floats:
        """Derivative of the whitened residuals by central differences, (2 n_b m, p); one-sided at a bound."""
        low, high = self.ranges.coordinates(self.ranges.lower), self.ranges.coordinates(self.ranges.upper)
        change = np.empty((*self.one.readings.shape, q.size))
        for i, h in enumerate(_DIFFERENCE * self.ranges.spread):
            after, before = q.copy(), q.copy()
            after[i], before[i] = min(q[i] + h, high[i]), max(q[i] - h, low[i])
            change[..., i] = (self._model(before) - self._model(after)) / (after[i] - before[i])  # of −model
        return self.one.white(change).reshape(-1, q.size)

    def _spread_of_score(self, J: Floats) -> Floats:
        """M = 2 Re Jᴴ L⁻¹ Σ L⁻ᴴ J, (p, p), with Σ the covariance between neighboring bins too.

        Each side is widened by √(q/(q - n_y - 1)): the weights are estimates themselves, with q degrees of freedom, and
        a bin whose noise happens to look small gets too much weight.
        """
        G, index, roots = self.one.response, self.one.index, self.one.white.roots
        n, m, p = index.size, roots.shape[1], J.shape[1]
        q, n_y = G.degrees_of_freedom[index].astype(float), len(self.one.outputs)
        wide = np.sqrt(q / (q - len(G.output_names) - 1.0))[:, None, None]
        if not G.half_width:  # one bin shares nothing with another: what remains of L⁻¹ Σ L⁻ᴴ is the roots' correction
            own = (J.reshape(2, n, m * p) * (wide * np.sqrt((q - n_y) / q)[:, None, None])[..., 0]).reshape(J.shape)
            return np.asarray(own.T @ own)
        slopes = as_complex(J.reshape(2 * n, m, p)) / np.sqrt(2.0)
        A = np.einsum("kab,kap->kbp", roots.conj(), slopes * wide)  # L⁻ᴴ J
        channels = np.array([G.input_names.index(i) * len(G.output_names) + G.output_names.index(o)
                             for i in self.one.inputs for o in self.one.outputs])
        M, block = np.zeros((p, p)), len(G.output_names) * len(G.input_names)
        for first in range(0, n, _CHUNK):
            part = slice(first, min(first + _CHUNK, n))
            reach = 4 * G.half_width  # windows are shifted at the ends
            near = np.flatnonzero((index >= index[part][0] - reach) & (index <= index[part][-1] + reach))
            joint = G.joint_covariance(index[near]).reshape(near.size, block, near.size, block)
            at = np.searchsorted(near, np.arange(part.start, part.stop))
            joint = joint[at][:, channels][:, :, :, channels]
            M += 2.0 * np.einsum("kap,kalb,lbq->pq", A[part].conj(), joint, A[near], optimize=True).real
        return (M + M.T) / 2

    def _independent(self) -> float:
        """Degrees of freedom of the noise, all bins together: neighboring bins share their windows."""
        G, index = self.one.response, self.one.index
        stride = float(np.median(np.diff(index))) if index.size > 1 else 1.0
        q = float(G.degrees_of_freedom[index].sum())
        return max(q / max((2 * G.half_width + 1) / stride, 1.0), 1.0)


def _inverse_root(M: Floats) -> Floats:
    """W (k, p) with W M Wᵀ = 1 on the k directions that the data see at all."""
    size, vectors = np.linalg.eigh(M)
    kept = size > _ZERO * size[-1]
    return np.asarray((vectors[:, kept] / np.sqrt(size[kept])).T)
