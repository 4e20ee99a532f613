"""Bad input: one message that names the argument or the fault, from every estimator alike."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import robthermal as rt

rng = np.random.default_rng(0)
U, Y = rng.normal(size=(200, 1)), rng.normal(size=(200, 1))


def record(u: Any = U, y: Any = Y, **changes: Any) -> rt.Record:
    u, y = np.asarray(u), np.asarray(y)
    names = {
        "input_names": [f"u{i}" for i in range(np.atleast_2d(u.T).shape[0])],
        "output_names": [f"y{i}" for i in range(np.atleast_2d(y.T).shape[0])],
    }
    return rt.Record(**{"sample_time": 1.0, "inputs": u, "outputs": y, **names, **changes})


ESTIMATORS: dict[str, Callable[..., Any]] = {
    "etfe": rt.identify.etfe,
    "spectral": rt.identify.spectral,
    "lpm": rt.identify.lpm,
    "lrm": rt.identify.lrm,
    "lrmp": lambda r, **k: rt.identify.lrmp(r, poles=[-0.1], **k),
    "closed_loop": lambda r, **k: rt.identify.closed_loop(r, reference=U, **k),
    "bla": lambda r, **k: rt.identify.bla(r if isinstance(r, list) else [r] * 3, period=50, **k),
}
every = pytest.mark.parametrize("estimator", ESTIMATORS.values(), ids=ESTIMATORS.keys())
local = pytest.mark.parametrize("name", ["lpm", "lrm", "lrmp", "closed_loop", "bla"])


@every
@pytest.mark.parametrize("bad", [None, 3.0, "run.csv", U, {"u": U}])
def test_something_that_is_not_a_record(estimator: Callable[..., Any], bad: Any) -> None:
    with pytest.raises(rt.InputError, match="rt.Record"):
        estimator([bad])


@every
def test_an_empty_list(estimator: Callable[..., Any]) -> None:
    with pytest.raises(rt.InputError, match="empty"):
        estimator([])


@every
@pytest.mark.parametrize(
    ("other", "message"),
    [
        (record(sample_time=2.0), "sample_time"),
        (record(input_names=["v"]), "input_names"),
        (record(output_names=["T"]), "output_names"),
    ],
)
def test_records_that_do_not_belong_together(estimator: Callable[..., Any], other: rt.Record, message: str) -> None:
    with pytest.raises(rt.InputError, match=message):
        estimator([record(), other])


@pytest.mark.parametrize("name", ["etfe", "spectral", "lpm", "lrm", "lrmp", "bla"])
@pytest.mark.parametrize("level", [0.0, 20.0, -1e9])
def test_a_constant_input_is_named(name: str, level: float) -> None:
    with pytest.raises(rt.InputError, match="'heater' is constant.*excite"):
        ESTIMATORS[name](record(u=np.full(200, level), input_names=["heater"]))


@pytest.mark.parametrize("name", ["spectral", "lpm", "lrm", "lrmp", "bla"])
def test_copies_of_each_other_are_named(name: str) -> None:
    both = np.hstack([U, 5.0 - 2.0 * U])
    with pytest.raises(rt.InputError, match="'u0', 'u1' are copies"):
        ESTIMATORS[name](record(u=both))
    three = np.hstack([U, Y[::-1], U + Y[::-1]])
    with pytest.raises(rt.InputError, match="'u0', 'u1', 'u2' are copies"):
        ESTIMATORS[name](record(u=three) if name != "bla" else [record(u=three)] * 5)


def test_inputs_alike_up_to_phase_are_kept() -> None:
    both = np.hstack([U, np.roll(U, 1, axis=0)])
    assert np.isfinite(rt.identify.lpm(record(u=both)).response).mean() > 0.9


@local
@pytest.mark.parametrize("bad", [-1, 0, 2.5, float("nan"), float("inf"), "8", None, True])
def test_half_width(name: str, bad: Any) -> None:
    with pytest.raises(rt.InputError, match="half_width"):
        ESTIMATORS[name](record(), half_width=bad)


@pytest.mark.parametrize("name", ["lpm", "lrm", "closed_loop", "bla"])
@pytest.mark.parametrize("bad", [-1, 0.5, float("nan"), "2", None, True])
def test_degree(name: str, bad: Any) -> None:
    with pytest.raises(rt.InputError, match="degree"):
        ESTIMATORS[name](record(), degree=bad)


@pytest.mark.parametrize("name", ["lpm", "lrm", "lrmp", "closed_loop"])
def test_a_window_wider_than_the_record(name: str) -> None:
    with pytest.raises(rt.InputError, match="half_width"):
        ESTIMATORS[name](record(), half_width=80)


@pytest.mark.parametrize("name", ["lpm", "lrm", "lrmp", "closed_loop"])
def test_no_degrees_of_freedom_left(name: str) -> None:
    changes = {"half_width": 1} if name == "lrmp" else {"degree": 8}
    with pytest.raises(rt.InputError, match="no degrees of freedom"):
        ESTIMATORS[name](record(), **changes)


def test_a_record_of_two_samples_has_no_bins() -> None:
    for estimator in ESTIMATORS.values():
        with pytest.raises(rt.InputError):
            estimator(record(u=U[:2], y=Y[:2]))


def test_too_many_poles_leave_no_degrees_of_freedom() -> None:
    with pytest.raises(rt.InputError, match="no degrees of freedom.*fewer poles"):
        rt.identify.lrmp(record(), poles=[-0.1 * i for i in range(1, 9)])


@pytest.mark.parametrize(
    ("poles", "message"),
    [
        ([], "no pole"),
        ([float("nan")], "not finite"),
        ([-0.1, float("-inf")], "not finite"),
        ([0.3], "unstable"),
        ([-0.1, 0.2 + 1j], "unstable"),
        ([0.0], "imaginary axis"),
        ([2j], "imaginary axis"),
        ("slow", "'auto'"),
        ("", "'auto'"),
        (None, "neither poles nor basis"),
        ({"a": 1}, "poles"),
        ([[-0.1]], "poles"),
        (["-0.1"], "poles"),
        ([True], "poles"),
        ([[-0.1], [-0.1, -0.2]], "poles"),
    ],
)
def test_poles(poles: Any, message: str) -> None:
    with pytest.raises(rt.InputError, match=message) as caught:
        rt.identify.lrmp(record(), poles=poles)
    assert "pole" in str(caught.value)


@pytest.mark.parametrize(
    ("reference", "message"),
    [
        (U[:-1], "length"),
        (np.zeros(200), "constant"),
        (np.full(200, 298.0), "constant"),
        (np.hstack([U, Y]), "2 columns"),
        (np.where(np.arange(200) == 7, np.nan, 1.0), r"reference\[7, 0\] is not finite"),
        (U * 1j, "complex"),
        (["a"] * 200, "real numbers"),
        (None, "reference"),
        (np.zeros((200, 1, 1)), "length"),
    ],
)
def test_reference(reference: Any, message: str) -> None:
    with pytest.raises(rt.InputError, match=message):
        rt.identify.closed_loop(record(), reference=reference)


def test_closed_loop_shapes_and_words() -> None:
    with pytest.raises(rt.InputError, match="inverse"):
        rt.identify.closed_loop(record(), reference=U, inverse="pseudo")
    with pytest.raises(rt.InputError, match="as many outputs as inputs"):
        rt.identify.closed_loop(record(y=np.hstack([Y, U])), reference=U, inverse="elementwise")


@pytest.mark.parametrize("period", [-50, 0, 2.5, float("nan"), "50", None, 101, 1000])
def test_period(period: Any) -> None:
    with pytest.raises(rt.InputError, match="period"):
        rt.identify.bla([record()] * 3, period=period)


def test_bla_counts() -> None:
    with pytest.raises(rt.InputError, match="at least 2 records"):
        rt.identify.bla([record()], period=50)
    with pytest.raises(rt.InputError, match="equal length"):
        rt.identify.bla([record(), record(u=U[:150], y=Y[:150])], period=50)
    with pytest.raises(rt.InputError, match="no line.*period"):
        rt.identify.bla([record(), record()], period=50)  # the input is noise, not periodic


@pytest.mark.parametrize("bad", [{"segments": 0}, {"segments": 1.5}, {"window": "hanning"}, {"overlap": 1.0}])
def test_spectral_settings(bad: dict[str, Any]) -> None:
    with pytest.raises(rt.InputError, match=next(iter(bad))):
        rt.identify.spectral(record(), **bad)


def test_etfe_needs_as_many_records_as_inputs() -> None:
    with pytest.raises(rt.InputError, match="at least as many records as inputs"):
        rt.identify.etfe(record(u=np.hstack([U, Y])))


def test_an_input_that_no_window_can_tell_from_the_transient_is_refused() -> None:
    # A single line determines G at that line and nowhere else; a line beyond the last bin nowhere at all.
    drift = np.cos(2 * np.pi * np.arange(200) / 200)
    G = rt.identify.lpm(record(u=np.hstack([U, drift[:, None]])))
    assert np.isnan(G.response[0, 1, 1:]).all()
    assert "u1" in " ".join(G.notes)
    nyquist = np.where(np.arange(200) % 2, 1.0, -1.0)
    with pytest.raises(rt.InputError, match="'u0' cannot be told from the transient"):
        rt.identify.lpm(record(u=nyquist))
