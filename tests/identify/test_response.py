"""The result object: regions, files, python-control, drawings, parts, words."""

from __future__ import annotations

import json

import control
import numpy as np
import pytest
from scipy import stats

import robthermal as rt
from robthermal.identify import FrequencyResponse

NAMES = ("frequencies", "response", "covariance", "noise_covariance", "degrees_of_freedom", "suspect", "transient")


@pytest.fixture(scope="module")
def estimate(network) -> FrequencyResponse:
    return rt.identify.lpm(network(2).record(np.random.default_rng(0), 300, 0.01))


def test_shapes_and_units_of_the_contract(estimate: FrequencyResponse) -> None:
    n_f = 149
    np.testing.assert_allclose(estimate.frequencies, np.arange(1, 150) / 300.0)
    assert estimate.response.shape == (2, 2, n_f)
    assert estimate.covariance.shape == (4, 4, n_f)
    assert estimate.noise_covariance.shape == (2, 2, n_f)
    assert estimate.degrees_of_freedom.shape == estimate.suspect.shape == (n_f,)
    assert estimate.transient.shape == estimate.coherence.shape == (2, n_f)
    assert estimate.suspect.dtype == bool
    np.testing.assert_allclose(estimate.covariance, estimate.covariance.conj().transpose(1, 0, 2), atol=1e-14)


def test_confidence_radius_is_the_f_region(estimate: FrequencyResponse) -> None:
    for p in (0.5, 0.95):
        factor = stats.f.ppf(p, 2, 2 * estimate.degrees_of_freedom)
        for o in range(2):
            for i in range(2):
                variance = estimate.covariance[2 * i + o, 2 * i + o].real
                np.testing.assert_allclose(estimate.confidence_radius(p)[o, i] ** 2, factor * variance)


@pytest.mark.parametrize("p", [0.0, 1.0, -0.1, 95, float("nan"), "0.95", None, True])
def test_a_confidence_level_outside_zero_to_one_is_refused(estimate: FrequencyResponse, p: object) -> None:
    with pytest.raises(rt.InputError, match="confidence level p"):
        estimate.confidence_radius(p)


@pytest.mark.parametrize("suffix", ["json", "mat", "npz"])
def test_files_keep_everything_exactly(estimate: FrequencyResponse, tmp_path, suffix: str) -> None:
    estimate.save(tmp_path / f"G.{suffix}")
    back = FrequencyResponse.load(tmp_path / f"G.{suffix}")
    for name in (*NAMES, "coherence"):
        np.testing.assert_array_equal(getattr(back, name), getattr(estimate, name), err_msg=name)
    assert (back.input_names, back.output_names) == (estimate.input_names, estimate.output_names)
    assert (back.method, back.notes, back.n_samples) == (estimate.method, estimate.notes, estimate.n_samples)
    np.testing.assert_allclose(back.confidence_radius(), estimate.confidence_radius())


@pytest.mark.parametrize("suffix", ["json", "mat", "npz"])
def test_files_keep_nan_infinity_and_single_entries(tmp_path, suffix: str) -> None:
    G = FrequencyResponse(
        frequencies=[0.5],
        response=[[[complex(1.0, np.inf)]]],
        covariance=[[[np.nan]]],
        noise_covariance=[[[2.0]]],
        nonlinear_covariance=[[[3.0]]],
        ratio_uncertainty=[[[0.5]]],
        degrees_of_freedom=[4.5],
        input_names=["Eingang 'ä'"],
        output_names=["y"],
        sample_time=1.0,
        n_samples=10,
        method="by hand",
        notes=["one", ""],
    )
    G.save(tmp_path / f"G.{suffix}")
    back = FrequencyResponse.load(tmp_path / f"G.{suffix}")
    for name in (*NAMES, "nonlinear_covariance", "ratio_uncertainty"):
        np.testing.assert_array_equal(getattr(back, name), getattr(G, name), err_msg=name)
    assert back.input_names == G.input_names and back.notes == G.notes


def test_json_is_plain_json(estimate: FrequencyResponse, tmp_path) -> None:
    estimate.save(tmp_path / "G.json")
    content = json.loads((tmp_path / "G.json").read_text(encoding="utf-8"))
    assert content["input_names"] == ["q0", "q1"]
    assert content["response"]["shape"] == [2, 2, 149]


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("G.pkl", b"\x80\x04N.", "cannot be read"),
        ("absent.json", None, "no such file"),
        ("G.json", b"[1, 2]", "cannot be read"),
        ("G.json", b"{", "cannot be read"),
        ("G.json", b'{"format": "else"}', "format"),
        ("G.json", b'{"format": "robthermal frequency response 1"}', "lacks"),
        ("G.npz", b"PK nonsense", "cannot be read"),
        ("G.mat", b"nonsense", "no frequency response"),
    ],
)
def test_files_that_are_not_ours_are_refused(tmp_path, name: str, content: bytes | None, message: str) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(rt.InputError, match=message):
        FrequencyResponse.load(tmp_path / name)


def test_a_pickle_inside_npz_is_not_opened(tmp_path) -> None:
    np.savez(tmp_path / "G.npz", format=np.array([{"a": 1}], dtype=object))
    with pytest.raises(rt.InputError, match="cannot be read"):
        FrequencyResponse.load(tmp_path / "G.npz")


def test_to_control_evaluates_to_the_same_numbers(estimate: FrequencyResponse) -> None:
    frd = estimate.to_control()
    assert isinstance(frd, control.FrequencyResponseData)
    omega = 2 * np.pi * estimate.frequencies
    np.testing.assert_allclose(frd.omega, omega)
    np.testing.assert_allclose(frd(1j * omega[3]), estimate.response[..., 3])
    loop = frd * control.ss([], [], [], np.eye(2))  # combines with continuous-time models
    np.testing.assert_allclose(loop(1j * omega[3]), estimate.response[..., 3])


def test_plots_have_the_axes_promised(estimate: FrequencyResponse) -> None:
    axes = estimate.plot()
    assert axes.shape == (4, 2)
    assert axes[-1, 0].get_xlabel() == "frequency [Hz]"
    np.testing.assert_allclose(axes[0, 1].lines[0].get_ydata(), np.abs(estimate.response[0, 1]))
    assert estimate.plot("coherence").shape == estimate.plot("transient").shape == (2,)
    with pytest.raises(rt.InputError, match="kind"):
        estimate.plot("nyquist")


def test_between_is_the_same_estimate_on_fewer_bins(estimate: FrequencyResponse) -> None:
    part = estimate.between(0.1, 0.2)
    inside = (estimate.frequencies >= 0.1) & (estimate.frequencies <= 0.2)
    for name in (*NAMES, "coherence"):
        np.testing.assert_allclose(getattr(part, name), getattr(estimate, name)[..., inside], rtol=1e-12, err_msg=name)
    first = int(np.flatnonzero(inside)[0])
    np.testing.assert_allclose(part.joint_covariance([0, 2]), estimate.joint_covariance([first, first + 2]))
    with pytest.raises(rt.InputError, match="no frequency between"):
        estimate.between(2.0, 3.0)


def test_noise_left_out_of_the_first_pass_is_computed_on_request(monkeypatch, network) -> None:
    record = network(2).record(np.random.default_rng(1), 3000, 0.01)
    whole = rt.identify.lpm(record)
    monkeypatch.setattr("robthermal.identify._local._FULL_NOISE_BYTES", 0)
    lazy = rt.identify.lpm(record)
    np.testing.assert_allclose(lazy.noise_variance, whole.noise_variance, rtol=1e-12)
    np.testing.assert_allclose(lazy.between(0.0, 0.01).covariance, whole.between(0.0, 0.01).covariance, rtol=1e-12)
    np.testing.assert_allclose(lazy.noise_covariance, whole.noise_covariance, rtol=1e-12)


def test_results_are_not_edited_after_the_fact(estimate: FrequencyResponse) -> None:
    for name in ("response", "covariance", "noise_covariance"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(estimate, name)[:] = 0.0
    with pytest.raises(AttributeError):
        estimate.response = np.zeros(1)


def test_the_table_names_channels_and_the_outcome(estimate: FrequencyResponse) -> None:
    text = str(estimate)
    assert all(name in text for name in ("q0", "q1", "T0", "T1", "lpm, degree 2"))
    assert text.endswith(str(estimate.outcome))
    assert estimate.outcome.code == "suspect" and "lrmp" in estimate.outcome.text


def test_coherence_is_the_part_of_the_power_that_the_input_explains() -> None:
    rng = np.random.default_rng(2)
    u, v = rng.normal(size=(2, 4000))
    G = rt.identify.lpm(rt.Record(sample_time=1.0, inputs=u, outputs=u + v, input_names=["u"], output_names=["y"]))
    assert abs(G.coherence.mean() - 0.5) < 0.05


def test_wrong_shapes_are_refused() -> None:
    with pytest.raises(rt.InputError, match="noise_covariance has shape"):
        FrequencyResponse(
            frequencies=[1.0, 2.0],
            response=np.ones((1, 1, 2)),
            covariance=np.ones((1, 1, 2)),
            noise_covariance=np.ones((1, 1, 3)),
            degrees_of_freedom=[3, 3],
            input_names=["u"],
            output_names=["y"],
            sample_time=1.0,
            n_samples=6,
            method="by hand",
        )


@pytest.mark.parametrize("p", [0.05, 0.5, 0.95, 0.999])
def test_radius_of_the_circle_is_the_quantile_of_f(p):
    """With one input and variance one the squared radius is F_p(2, 2q), whatever q."""
    for q in (1, 5, 11, 400):
        G = rt.identify.FrequencyResponse(frequencies=[0.1], response=np.ones((1, 1, 1)), degrees_of_freedom=[q],
                                          covariance=np.ones((1, 1, 1)), noise_covariance=np.ones((1, 1, 1)),
                                          input_names=["u"], output_names=["y"], sample_time=1.0, n_samples=10,
                                          method="given")
        assert G.confidence_radius(p)[0, 0, 0] ** 2 == pytest.approx(stats.f.ppf(p, 2, 2 * q), rel=1e-12)


@pytest.mark.parametrize(("n_u", "n_y", "n_f"), [(1, 1, 3), (2, 3, 40_000), (3, 1, 9_000)])
def test_the_covariance_is_the_kronecker_product_at_every_bin(n_u: int, n_y: int, n_f: int) -> None:
    rng = np.random.default_rng(n_f)
    gram, noise = (rng.normal(size=(n, n, n_f)) + 1j * rng.normal(size=(n, n, n_f)) for n in (n_u, n_y))
    names = [f"q{i}" for i in range(n_u)], [f"T{o}" for o in range(n_y)]
    estimate = FrequencyResponse(
        frequencies=np.arange(1.0, n_f + 1), response=np.ones((n_y, n_u, n_f)), gram=gram, noise_covariance=noise,
        degrees_of_freedom=np.full(n_f, 9), input_names=names[0], output_names=names[1], sample_time=0.1,
        n_samples=2 * n_f + 2, method="by hand")
    for k in {0, n_f // 2, n_f - 1, *rng.integers(0, n_f, 30).tolist()}:
        np.testing.assert_allclose(estimate.covariance[..., k], np.kron(gram[..., k], noise[..., k]), rtol=1e-14)
