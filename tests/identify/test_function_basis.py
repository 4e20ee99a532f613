"""Functions instead of poles: coverage on a slab in finite differences, brute force, the functions, refusals."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from slab import Slab

import robthermal as rt
from robthermal.identify import Diffusion, FractionalPole

SLOW = Slab(3000.0)  # slowest time constant 1216 s, longer than the records
BASIS = "diffusion:held:3000"


@pytest.fixture(scope="module")
def records() -> list[rt.Record]:
    rng = np.random.default_rng(0)
    return [SLOW.record(rng, 1000, 0.002, past=4000) for _ in range(40)]


def rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.abs(error) ** 2)))


def test_circles_cover_and_the_noise_is_right_also_at_the_lowest_bins(records: list[rt.Record]) -> None:
    inside, ratios = [], []
    for record in records:
        G = rt.identify.lrmp(record, basis=BASIS)
        inside.append(abs(G.response[0, 0] - SLOW.response(G.frequencies)) < G.confidence_radius()[0, 0])
        ratios.append(G.noise_variance.mean() / 0.002**2)
    assert 0.94 < np.mean(inside) < 0.96
    assert np.mean([i[:12] for i in inside]) > 0.86  # 40 windows: 0.95 has a deviation of 0.035; poles: 0.6
    assert abs(np.mean(ratios) - 1.0) < 0.02


def test_the_lowest_dozen_bins_are_three_times_nearer_than_with_polynomials_or_poles(records: list[rt.Record]) -> None:
    errors: dict[str, list[np.ndarray]] = {"lpm": [], "lrm": [], "auto": [], "poles": [], "functions": []}
    for record in records[:8]:
        for name, G in (("lpm", rt.identify.lpm(record)), ("lrm", rt.identify.lrm(record)),
                        ("auto", rt.identify.lrmp(record, "auto")),
                        ("poles", rt.identify.lrmp(record, SLOW.modes[0][:-4:-1])),
                        ("functions", rt.identify.lrmp(record, basis=BASIS))):
            truth = SLOW.response(G.frequencies[:12])
            errors[name].append((G.response[0, 0, :12] - truth) / np.abs(truth))
    mine = rms(np.array(errors.pop("functions")))
    assert mine < 0.02
    assert {name: rms(np.array(error)) > 3.0 * mine for name, error in errors.items()} == dict.fromkeys(errors, True)


@pytest.mark.parametrize(("k", "count"), [(1, 2), (5, 2), (25, 2), (1, 1), (200, 1), (499, 1)])
def test_a_bin_equals_least_squares_on_the_functions(records: list[rt.Record], k: int, count: int) -> None:
    G = rt.identify.lrmp(records[0], basis=[BASIS, "fractional:0.05:0.7"][:count])
    U, Y = (np.fft.rfft(x[:, 0] - x.mean(), norm="ortho") for x in (records[0].inputs, records[0].outputs))
    rows = np.arange(17) + min(max(k - 8, 1), 499 - 16)
    s, center = 2j * np.pi * rows / 1000, 2j * np.pi * k / 1000

    def functions(s: np.ndarray) -> np.ndarray:
        held = (1 - np.exp(-s)) / s
        return np.stack([s**0, held * np.tanh(np.sqrt(3000 * s)) / np.sqrt(3000 * s),
                         held / ((s / 0.05) ** 0.7 + 1)][: count + 1], axis=-1)

    plant = functions(s)
    K = np.hstack([plant * U[rows, None], plant, (rows - k)[:, None] * plant])
    scale = np.linalg.norm(K, axis=0)
    theta, *_ = np.linalg.lstsq(K / scale, Y[rows], rcond=1e-13)
    np.testing.assert_allclose(G.response[0, 0, k - 1], functions(center) @ (theta / scale)[: count + 1], rtol=1e-5)
    np.testing.assert_allclose(G.transient[0, k - 1], functions(center) @ (theta / scale)[count + 1 : 2 * count + 2],
                               rtol=1e-3)
    assert G.degrees_of_freedom[0] == 17 - 3 * (count + 1)


def test_records_of_two_lengths_and_two_inputs_give_one_response() -> None:
    rng = np.random.default_rng(3)
    found = []
    for n in (1500, 1000):
        one, two = Slab(800.0).record(rng, n, 0.0, past=500), Slab(300.0).record(rng, n, 0.0, past=500)
        found.append(rt.Record(sample_time=1.0, inputs=np.hstack([one.inputs, two.inputs]), input_names=["a", "b"],
                               outputs=one.outputs + 2.0 * two.outputs + 0.001 * rng.normal(size=(n, 1)),
                               output_names=["T"]))
    G = rt.identify.lrmp(found, half_width=10, basis=[Diffusion("held", 800.0), Diffusion("held", 300.0)])
    truth = np.array([Slab(800.0).response(G.frequencies), 2.0 * Slab(300.0).response(G.frequencies)])
    assert 0.93 < np.mean(abs(G.response[0] - truth) < G.confidence_radius()[0]) < 0.97
    assert np.array_equal(pickle.loads(pickle.dumps(G)).transient, G.transient)


def test_callables_are_the_same_as_ready_made_functions(records: list[rt.Record]) -> None:
    def both(f: np.ndarray) -> np.ndarray:
        q = np.sqrt(2j * np.pi * f * 3000.0)
        return np.stack([np.tanh(q) / q, 1.0 / (1.0 + (2j * np.pi * f / 0.05) ** 0.7)])

    made = rt.identify.lrmp(records[0], basis=[Diffusion("held", 3000.0), FractionalPole(0.05, 0.7)])
    own = rt.identify.lrmp(records[0], basis=both)
    np.testing.assert_allclose(own.response, made.response, rtol=1e-9)
    assert "both" in own.method and "fractional:0.05:0.7" in made.method


@pytest.mark.parametrize(("function", "truth"), [
    (Diffusion("held", 50.0), Slab(50.0, 400).continuous),
    (Diffusion("insulated", 50.0), Slab(50.0, 400, insulated=True).continuous),
    (Diffusion(), lambda f: Slab(2000.0, 400).continuous(f) * np.sqrt(2000.0)),  # a body too thick to feel its far face
    (FractionalPole(4.0, 0.5), Slab(2000.0, 400, film=np.sqrt(8000.0)).continuous),  # air beyond a film: (h/k)^2 a
])
def test_functions_are_those_of_bodies_in_finite_differences(function, truth) -> None:
    f = np.geomspace(3e-3, 3e-2, 7)
    np.testing.assert_allclose(function(f), truth(f), rtol=2e-3)


def test_a_fractional_pole_of_order_one_is_a_pole() -> None:
    f = np.geomspace(1e-4, 1.0, 5)
    np.testing.assert_allclose(FractionalPole(0.1, 1.0)(f), 1.0 / (2j * np.pi * f / 0.1 + 1.0), rtol=1e-14)


@pytest.mark.parametrize(("basis", "said"), [
    ("sqrt", "diffusion:held:TAU"), ("diffusion:held", "diffusion:held:TAU"), ("diffusion:held:-3", "time_constant"),
    ("diffusion:open:3", "far_face"), ("fractional:0.1:2", "order is 2"), ("fractional:0:1", "corner"),
    (["diffusion", "diffusion:held:60000"], "diffusion:held:60000 is within .* of the constant and diffusion"),
    ("fractional:1e12:0.5", "fractional:1e\\+12:0.5 is within .* of the constant"), ([], "no function"), (3, "got 3"),
    (lambda f: f[:3], r"shape \(3,\)"), (lambda f: 1 / 0, "ZeroDivisionError"), (lambda f: "no", "shape"),
    (lambda f: np.where(f > 0.1, np.nan, f), "not finite at 0.101 Hz"),
    (lambda f: np.array([f, 2 * f]), r"basis\[0\]\[1\] is within"), (lambda f: 0 * f, "within"),
])
def test_what_is_no_basis_is_refused_by_name(records: list[rt.Record], basis, said: str) -> None:
    with pytest.raises(rt.InputError, match=said):
        rt.identify.lrmp(records[0], basis=basis)


@pytest.mark.parametrize(("arguments", "said"), [
    ({}, "neither poles nor basis"), ({"poles": [-1.0], "basis": "diffusion"}, "together"),
    ({"basis": "diffusion", "half_width": 2}, "no degrees of freedom"),
    ({"basis": Diffusion(), "half_width": 400}, "wider than the record"),
])
def test_arguments_that_do_not_go_together(records: list[rt.Record], arguments, said: str) -> None:
    with pytest.raises(rt.InputError, match=said):
        rt.identify.lrmp(records[0], **arguments)


def test_an_infinite_body_has_no_time_constant() -> None:
    with pytest.raises(rt.InputError, match="infinite"):
        Diffusion("infinite", 3.0)
    with pytest.raises(rt.InputError, match="time_constant"):
        Diffusion("held")
