"""Joint covariance of a frequency response over channels and bins, and the linear map that makes its errors white.

Errors of an estimate with window weights W_a and noise V are e_a = W_a V (columns stacked), so
E[e_(a,i) e_(b,j)ᴴ] = s_(ai,bj) L_a L_bᴴ with s the inner products of the weights and L_a L_aᴴ = C_V at bin a. Whitening
is therefore first L_a⁻¹ over the outputs, then the inverse Cholesky factor of s over bins and inputs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from ..errors import InputError
from ..identify import FrequencyResponse

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Places = NDArray[np.intp]
_LEAST = 0.1  # eigenvalue of the correlation between the bins kept: below it small biases would be blown up
_MOST = 2000  # rows of the correlation
_SPREAD = 0.02  # relative distance of the bins of a long response
_NONE: Complex = np.zeros((0, 0), np.complex128)


@dataclass(frozen=True, eq=False)
class ResponseWhitener:
    """Maps deviations of a response, real parts above imaginary parts (2 n_b, m, ...), to unit covariance.

    Parameters
    ----------
    roots : ndarray, shape (n_b, m, m)
        Inverse Cholesky factor of every bin, over the channels.
    factor : ndarray, shape (n_b n_u, n_b n_u), or (0, 0)
        Cholesky factor of the correlation over bins and inputs; empty if the bins are independent.
    n_outputs : int
        Channels that share an input.
    """

    roots: Complex
    factor: Complex
    n_outputs: int

    def __call__(self, r: Array, out: Array | None = None) -> Array:
        """Whiten, into `out` of the same shape if it is given; real and imaginary parts of variance one."""
        n, m = self.roots.shape[:2]
        flat = as_complex(r.reshape(2 * n, m, -1))
        z = np.sqrt(2.0) * (self.roots @ flat)  # circular noise: half the variance in either part
        if self.factor.size:
            columns = z.reshape(n * m // self.n_outputs, -1)
            z = scipy.linalg.solve_triangular(self.factor, columns, lower=True).reshape(n, m, -1)
        white = as_real(z).reshape(r.shape)
        if out is None:
            return white
        out[...] = white
        return out


def as_real(z: Complex) -> Array:
    """Real parts above imaginary parts, (2 n_b, ...)."""
    return np.concatenate([z.real, z.imag])


def as_complex(r: Array) -> Complex:
    """Inverse of `as_real`."""
    half = len(r) // 2
    out: Complex = r[:half] + 1j * r[half:]
    return out


def shared_weights(G: FrequencyResponse, index: Places, inputs: Places) -> Complex:
    """s, the inner products of the window weights of bins and inputs, (n_b n_u, n_b n_u)."""
    n_y, n_u, n = len(G.output_names), len(G.input_names), index.size
    joint = G.joint_covariance(index).reshape(n, n_u, n_y, n, n_u, n_y)[:, inputs, 0][:, :, :, inputs, 0]
    level = G.noise_covariance[0, 0, index].real
    mean = 0.5 * (level[:, None] + level)  # as in `joint_covariance`
    out: Complex = (joint / mean[:, None, :, None]).reshape(n * len(inputs), n * len(inputs))
    return out


def kept_bins(G: FrequencyResponse, good: Places, inputs: Places) -> tuple[Places, Complex]:
    """Bins to use, and the Cholesky factor of s over them (empty if independent).

    Estimates a third of a window apart hold nearly all the information and are well-conditioned together. Where the
    response does not know how its bins are correlated (one from a file), one bin per window is kept. Of long responses
    bins at least two per cent apart.
    """
    window = 2 * G.half_width + 1
    if G.half_width == 0 or good.size < 2:
        return thinned(good, 1, _MOST), _NONE
    if not np.any(shared_weights(G, good[:2], inputs)[:len(inputs), len(inputs):]):
        return thinned(good, window, _MOST), _NONE
    index, s = good, _NONE
    for step in range(max(1, window // 3), window + 1):
        index = thinned(good, step, _MOST // len(inputs))
        s = shared_weights(G, index, inputs)
        scale = np.sqrt(np.diag(s).real)
        if np.linalg.eigvalsh(s / np.outer(scale, scale))[0] > _LEAST:
            break
    try:
        return index, np.asarray(np.linalg.cholesky(s), np.complex128)
    except np.linalg.LinAlgError:
        raise InputError("the estimates at different frequencies are not independent of each other",
                         where="argument records", expected="windows that hold data of their own",
                         remedy="Estimate the response with a larger half_width, or from a longer record.") from None


def every_bin(G: FrequencyResponse, good: Places) -> tuple[Places, Complex]:
    """All bins if the response knows their correlation (one from a file does not); else one per window."""
    if G.half_width and good.size > 1:
        pair = G.joint_covariance(good[:2])
        if not np.any(pair[:len(pair) // 2, len(pair) // 2:]):
            return good[::2 * G.half_width + 1], _NONE
    return good, _NONE


def thinned(good: Places, step: int, most: int) -> Places:
    """Bins at least `step` apart; two per cent apart if there would be more than `most`."""
    kept = [int(good[0])]
    share = _SPREAD if good.size > step * most else 0.0
    for b in good[1:]:
        if b - kept[-1] >= max(step, share * b):
            kept.append(int(b))
    return np.array(kept, np.intp)


def response_whitener(G: FrequencyResponse, index: Places, factor: Complex, outputs: Places,
                      inputs: Places) -> ResponseWhitener:
    """Whitener of the channels of a response, inputs outermost.

    The noise is an estimate with q degrees of freedom: E[C_V⁻¹] is q/(q - n_y) times the inverse (complex Wishart), and
    the roots are corrected for it.
    """
    if factor.size:
        noise = inverse_roots(np.moveaxis(G.noise_covariance[np.ix_(outputs, outputs, index)], -1, 0), G, index)
        roots = np.stack([np.kron(np.eye(len(inputs)), root) for root in noise])
    else:
        channels = (inputs[:, None] * len(G.output_names) + outputs).ravel()
        roots = inverse_roots(np.moveaxis(G.covariance[np.ix_(channels, channels, index)], -1, 0), G, index)
    q = G.degrees_of_freedom[index].astype(float)
    return ResponseWhitener(roots * np.sqrt((q - len(outputs)) / q)[:, None, None], factor, len(outputs))


def inverse_roots(covariance: Complex, G: FrequencyResponse, index: Places) -> Complex:
    """L⁻¹ of every L Lᴴ."""
    sound = [_is_definite(c) for c in covariance]
    if not all(sound):
        raise InputError(f"the covariance of the response at {G.frequencies[index[sound.index(False)]]:.4g} Hz is "
                         "missing or singular", where="argument records", expected="noise in every channel",
                         remedy="Estimate the response with rt.identify.lpm or lrmp, which give its covariance.")
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)), np.complex128)


def _is_definite(c: Complex) -> bool:
    """Whether a covariance can be inverted, whatever the units of its channels."""
    scale = np.sqrt(np.diag(c).real)
    if not (np.all(np.isfinite(c)) and np.all(scale > 0.0)):
        return False
    return bool(np.linalg.eigvalsh(c / np.outer(scale, scale))[0] > 1e-13)
