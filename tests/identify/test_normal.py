"""Local polynomial estimates through normal equations, against least squares window by window."""

from __future__ import annotations

import numpy as np
import pytest

import robthermal as rt


def record_of(n_u: int, n_y: int, noise: float, n: int = 2500, seed: int = 0) -> rt.Record:
    """Two lags per path from a cold start, 1 K per unit of input at low frequency, white noise [K]."""
    rng = np.random.default_rng(seed)
    U = rng.normal(size=(n, n_u))
    gains, X = rng.uniform(0.5, 1.5, (n_y, n_u)), np.zeros((2, n_u))
    Y = np.empty((n, n_y))
    for k in range(n):
        Y[k] = gains @ X.sum(axis=0)
        X = np.array([[0.9], [0.6]]) * X + np.array([[0.05], [0.2]]) * U[k]
    Y += 300.0 + noise * rng.normal(size=Y.shape)
    names = [f"u{i}" for i in range(n_u)], [f"y{o}" for o in range(n_y)]
    return rt.Record(sample_time=1.0, inputs=U, outputs=Y, input_names=names[0], output_names=names[1])


def least_squares(records: list[rt.Record], k: int, half_width: int, degree: int) -> tuple[np.ndarray, ...]:
    """G, its gram block and the noise covariance at bin k, by numpy.linalg.lstsq on the whole window."""
    rows, outputs, n_r = [], [], len(records)
    r = np.arange(-half_width, half_width + 1.0) / half_width
    for place, record in enumerate(records):
        part = slice(k - half_width, k + half_width + 1)
        U, Y = (np.fft.fft(x - x.mean(axis=0), axis=0, norm="ortho")[part] for x in (record.inputs, record.outputs))
        transients = np.zeros((r.size, n_r * (degree + 1)))
        transients[:, place * (degree + 1) : (place + 1) * (degree + 1)] = np.vander(r, degree + 1, increasing=True)
        plant = [r[:, None] ** s * U for s in range(degree + 1)]
        rows.append(np.hstack([*plant, transients]))
        outputs.append(Y)
    K, Y = np.vstack(rows), np.vstack(outputs)
    theta = np.linalg.lstsq(K, Y, rcond=None)[0]
    residual, n_u = Y - K @ theta, records[0].inputs.shape[1]
    gram = np.linalg.inv(K.conj().T @ K)[:n_u, :n_u]
    return theta[:n_u].T, gram, residual.T @ residual.conj() / (K.shape[0] - K.shape[1])


@pytest.mark.parametrize(("n_u", "n_y", "n_r", "half_width", "degree"),
                         [(1, 1, 1, 8, 2), (2, 2, 1, 8, 2), (1, 2, 2, 5, 1), (2, 1, 3, 6, 3), (1, 1, 1, 3, 0)])
@pytest.mark.parametrize("noise", [1e-3, 0.05])
def test_every_digit_that_is_promised(n_u, n_y, n_r, half_width, degree, noise):
    """1e-8 on G and 1e-6 on the noise, where the noise is 1 mK beside a swing of 1 K."""
    records = [record_of(n_u, n_y, noise, seed=seed) for seed in range(n_r)]
    G = rt.identify.lpm(records, degree=degree, half_width=half_width)
    for k in (10, 37, 500, 1100):
        response, gram, covariance = least_squares(records, k, half_width, degree)
        at = k - 1
        assert abs(G.response[..., at] - response).max() < 1e-8 * abs(response).max()
        assert abs(G.gram[..., at] - gram).max() < 1e-8 * abs(gram).max()
        assert abs(G.noise_covariance[..., at] - covariance).max() < 1e-6 * abs(covariance).max()


def test_clean_data_are_orthogonalized():
    """Without noise, what is left of |Y|^2 is rounding of the normal equations: 1e-9 of the swing must not be noise."""
    G = rt.identify.lpm(record_of(1, 1, 0.0), degree=3)
    response, _, covariance = least_squares([record_of(1, 1, 0.0)], 900, 8, 3)
    assert abs(G.response[..., 899] - response).max() < 1e-10
    assert G.noise_covariance[0, 0, 899].real == pytest.approx(covariance[0, 0].real, rel=0.05, abs=1e-26)


def test_a_bin_has_the_same_digits_in_every_request():
    G = rt.identify.lpm(record_of(2, 2, 1e-3, n=20_000))
    part = G.between(0.1, 0.1005)
    inside = (G.frequencies >= 0.1) & (G.frequencies <= 0.1005)
    np.testing.assert_array_equal(part.noise_covariance, G.noise_covariance[..., inside])
