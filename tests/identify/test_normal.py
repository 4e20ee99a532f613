"""Local polynomial estimates through normal equations, against least squares window by window."""

from __future__ import annotations

import compiled
import numpy as np
import pytest
from flint import acb, ctx

import robthermal as rt
from robthermal.identify import _compiled
from robthermal.identify._basis import LocalBasis


@pytest.fixture(params=["numpy", "built", "AVX2"], autouse=True)
def kernel(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every test on numpy, on the part of the library that this processor takes, and on the lesser one of x86-64."""
    found = None if request.param == "numpy" else compiled.built(4 if request.param == "AVX2" else None)
    monkeypatch.setattr(_compiled, "library", lambda: found)


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


def powers(half_width: int, degree: int) -> np.ndarray:
    """1, r, ... r^degree of the scaled offsets."""
    return np.vander(np.arange(-half_width, half_width + 1.0) / half_width, degree + 1, increasing=True)


def fractions(half_width: int, poles: np.ndarray, k: int, n: int) -> np.ndarray:
    """(z/z_k - 1)^s D(z_k)/D(z) of the window at bin k, scaled: the constant and one function per pole [1/sample]."""
    z = np.exp(2j * np.pi * np.arange(k - half_width, k + half_width + 1) / n)
    D = np.prod(z[:, None] - np.exp(poles), axis=1)
    x = (z / z[half_width] - 1.0) / abs(z[-1] - z[half_width])
    return np.vander(x, poles.size + 1, increasing=True) * (D[half_width] / D)[:, None]


def least_squares(records: list[rt.Record], k: int, functions: np.ndarray) -> tuple[np.ndarray, ...]:
    """G, its gram block and the noise covariance at bin k, by numpy.linalg.lstsq on the whole window."""
    rows, outputs, n_r = [], [], len(records)
    half_width, size = len(functions) // 2, functions.shape[1]
    for place, record in enumerate(records):
        part = slice(k - half_width, k + half_width + 1)
        U, Y = (np.fft.fft(x - x.mean(axis=0), axis=0, norm="ortho")[part] for x in (record.inputs, record.outputs))
        transients = np.zeros((len(functions), n_r * size), dtype=complex)
        transients[:, place * size : (place + 1) * size] = functions
        plant = [one[:, None] * U for one in functions.T]
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
        response, gram, covariance = least_squares(records, k, powers(half_width, degree))
        at = k - 1
        assert abs(G.response[..., at] - response).max() < 1e-8 * abs(response).max()
        assert abs(G.gram[..., at] - gram).max() < 1e-8 * abs(gram).max()
        assert abs(G.noise_covariance[..., at] - covariance).max() < 1e-6 * abs(covariance).max()


@pytest.mark.parametrize(("n_u", "n_y", "n_r", "half_width", "poles"),
                         [(1, 1, 1, 8, [-1e-3, -0.1, -0.5]), (2, 2, 1, 8, [-0.1, -0.5]),
                          (1, 2, 2, 6, [-0.02 + 0.3j, -0.02 - 0.3j]), (2, 1, 3, 7, [-2e-4, -2e-4, -3.0])])
@pytest.mark.parametrize("noise", [1e-3, 0.05])
def test_every_digit_also_with_prescribed_poles(n_u, n_y, n_r, half_width, poles, noise):
    """Real, complex, double, slow and fast poles [1/s], at bins below, at and above them."""
    records = [record_of(n_u, n_y, noise, seed=seed) for seed in range(n_r)]
    G = rt.identify.lrmp(records, poles=poles, half_width=half_width)
    for k in (10, 11, 37, 119, 500, 1100):
        functions = fractions(half_width, np.array(poles, dtype=complex), k, 2500)
        response, gram, covariance = least_squares(records, k, functions)
        at = k - 1
        assert abs(G.response[..., at] - response).max() < 1e-8 * abs(response).max()
        assert abs(G.gram[..., at] - gram).max() < 1e-8 * abs(gram).max()
        assert abs(G.noise_covariance[..., at] - covariance).max() < 1e-6 * abs(covariance).max()


@pytest.mark.parametrize("pole", [-1e-3, -0.5 + 1e-3j])
def test_the_denominator_has_all_digits_also_beside_its_zero(pole):
    """D and D/z^(n/2) in ball arithmetic, at the lowest bins of a long record, where z - gamma cancels in doubles."""
    n, basis = 10**6, LocalBasis(3, 2, 10**6, poles=np.array([pole, pole / 7], dtype=complex))
    bins = np.array([1.0, 2.0, 159.0, 499_000.0])
    with ctx.workprec(200):
        z = [(acb(0, 2) * acb.pi() * int(k) / n).exp() for k in bins]
        true = [(x - acb(complex(pole)).exp()) * (x - acb(complex(pole / 7)).exp()) for x in z]
        turned = [complex(d / x) for d, x in zip(true, z, strict=True)]
    np.testing.assert_allclose(basis.denominator(bins), [complex(d) for d in true], rtol=1e-13)
    np.testing.assert_allclose(basis.rotated_denominator(bins), turned, rtol=1e-13)


def test_clean_data_are_orthogonalized():
    """Without noise, what is left of |Y|^2 is rounding of the normal equations: 1e-9 of the swing must not be noise."""
    G = rt.identify.lpm(record_of(1, 1, 0.0), degree=3)
    response, _, covariance = least_squares([record_of(1, 1, 0.0)], 900, powers(8, 3))
    assert abs(G.response[..., 899] - response).max() < 1e-10
    assert G.noise_covariance[0, 0, 899].real == pytest.approx(covariance[0, 0].real, rel=0.05, abs=1e-26)


def test_a_bin_has_the_same_digits_in_every_request():
    G = rt.identify.lpm(record_of(2, 2, 1e-3, n=20_000))
    part = G.between(0.1, 0.1005)
    inside = (G.frequencies >= 0.1) & (G.frequencies <= 0.1005)
    np.testing.assert_array_equal(part.noise_covariance, G.noise_covariance[..., inside])
