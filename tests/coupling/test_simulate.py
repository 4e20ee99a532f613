"""Time simulation against python-control, switching that the loops do not see, stationary values by Monte Carlo."""

from __future__ import annotations

import control
import numpy as np
import pytest

import robthermal as rt

from .conftest import DT, Array, Pair, make_random_pair


def designed(seed: int, **more: object) -> tuple[Pair, rt.coupling.Filters]:
    """Hand-made filters for a random pair, with direct feedthrough."""
    pair = make_random_pair(seed)
    hats = [control.tf([size, 0.2], [1, -0.6], 0.01) for size in (-0.5, 0.4)]
    return pair, rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, X_hat=hats[0], Y_hat=hats[1],
                                      **more)  # type: ignore[arg-type]


def sensitivity(pair: Pair, K: control.StateSpace) -> control.StateSpace:
    """(I + PK)⁻¹ by python-control."""
    return control.feedback(control.ss([], [], [], np.eye(2), K.dt), control.append(pair.P1, pair.P2) * K)


def errors(pair: Pair, K: control.StateSpace, v: Array) -> Array:
    """e = -S v (2, n)."""
    times = np.arange(v.shape[1]) * K.dt
    return -np.asarray(control.forced_response(sensitivity(pair, K), times, v).outputs)


@pytest.mark.parametrize("seed", range(2))
def test_against_python_control(seed: int) -> None:
    pair, filters = designed(seed)
    v = np.random.default_rng(seed).standard_normal((2, 400)).cumsum(axis=1)
    run = rt.coupling.simulate(filters, disturbances=v)
    coupled = errors(pair, filters.controller, v)
    alone = errors(pair, control.append(pair.C1, pair.C2), v)
    size = np.abs(alone).max()
    np.testing.assert_allclose([run.e1, run.e2], coupled, atol=1e-9 * size)
    np.testing.assert_allclose(run.after, coupled[0] - coupled[1], atol=1e-9 * size)
    np.testing.assert_allclose(run.before, alone[0] - alone[1], atol=1e-9 * size)
    formula = control.forced_response(filters.e12, run.time, v).outputs  # (6.14)
    np.testing.assert_allclose(run.after, np.ravel(formula), atol=1e-8 * size)
    assert np.abs(run.after - run.before).max() > 0.05 * size  # the coupling does something


def test_switching_is_not_seen_by_the_loops(pair: Pair) -> None:
    filters = rt.coupling.evaluate(pair.P1, pair.P2, pair.C1, pair.C2, X_hat=control.tf([-0.09], [1, -0.9], DT),
                                   Y_hat=control.tf([-0.04], [1, -0.9], DT))
    v = np.random.default_rng(1).standard_normal((2, 1500)).cumsum(axis=1)
    run = rt.coupling.simulate(filters, disturbances=v, on=(400, 700))
    alone = errors(pair, control.append(pair.C1, pair.C2), v)
    size = np.abs(alone).max()
    np.testing.assert_allclose([run.e1_seen, run.e2_seen], alone, atol=1e-6 * size)
    assert run.on.sum() == 300 and run.on[400] and not run.on[700]
    difference = np.abs(run.after - run.before)
    assert difference[:401].max() < 1e-6 * size  # one sample of delay in X, Y
    assert difference[400:700].max() > 0.1 * size
    assert difference[1200:].max() < 1e-6 * size  # the filters have rung out
    # To replace the coupling controller by C1, C2 at once, their states kept, would be seen.
    K = filters.controller
    bumped = replaced(pair, K, K.nstates - pair.C1.nstates - pair.C2.nstates, v, 700)
    assert np.abs(bumped - np.array([run.e1, run.e2]))[:, :701].max() < 1e-6 * size
    assert np.abs(bumped - alone)[:, 705:1000].max() > 100 * np.abs(
        np.array([run.e1_seen, run.e2_seen]) - alone).max()


def replaced(pair: Pair, K: control.StateSpace, first: int, v: Array, moment: int) -> Array:
    """e when the coupling is on from 400 and its states (the first ones) are set to zero and cut at a moment."""
    P = control.append(pair.P1, pair.P2)
    x, k, e = np.zeros(P.nstates), np.zeros(K.nstates), np.empty(v.shape)
    for t in range(v.shape[1]):
        e[:, t] = -(v[:, t] + P.C @ x)
        if 400 <= t < moment:
            u, k = K.C @ k + K.D @ e[:, t], K.A @ k + K.B @ e[:, t]
        else:
            k[:first] = 0.0  # X, Y have no direct feedthrough: what is left is C1, C2
            u = K.C @ k + K.D @ e[:, t]
            k = K.A @ k + K.B @ e[:, t]
            k[:first] = 0.0
        x = P.A @ x + P.B @ u
    return e


def test_moving_average_and_deviation_by_monte_carlo() -> None:
    """48 independent runs: each of the four mean squares within 4.2 standard errors (t, 47: 99.99 % each)."""
    _, filters = designed(0, window=0.13, disturbances=(0.2, control.tf([0.1], [1, -0.9], 0.01)))
    runs = [rt.coupling.simulate(filters, samples=200, seed=seed) for seed in range(48)]
    for name in ("ma_before", "ma_after", "msd_before", "msd_after"):
        squares = np.array([9 * np.mean(getattr(run, name) ** 2) for run in runs])
        wrong = abs(squares.mean() - getattr(filters.performance, name) ** 2)
        assert wrong < 4.2 * squares.std(ddof=1) / np.sqrt(len(runs)), name
        assert squares.std(ddof=1) / np.sqrt(len(runs)) < 0.1 * squares.mean()  # the test has teeth
        assert getattr(runs[0].performance, name) ** 2 == pytest.approx(squares[0])
    assert not np.array_equal(runs[0].before, runs[1].before)
    assert "MSD" in str(runs[0])


def test_windows_are_means_and_deviations() -> None:
    _, filters = designed(1, window=0.05)
    run = rt.coupling.simulate(filters, samples=60, seed=3)
    assert run.samples == 5 and len(run.ma_after) == 56
    for k in (0, 17, 55):
        assert run.ma_after[k] == pytest.approx(run.after[k : k + 5].mean())
        assert run.msd_before[k] == pytest.approx(run.before[k : k + 5].std())


def test_a_record_of_disturbances() -> None:
    _, filters = designed(0)
    v = np.random.default_rng(0).standard_normal((2, 50))
    record = rt.Record(sample_time=0.01, inputs=np.zeros((50, 0)), outputs=v.T, input_names=[],
                       output_names=["v1", "v2"], units={"v1": "m"})
    np.testing.assert_array_equal(rt.coupling.simulate(filters, disturbances=record).after,
                                  rt.coupling.simulate(filters, disturbances=(v[0], v[1])).after)
    slow = rt.Record(sample_time=0.02, inputs=np.zeros((50, 0)), outputs=v.T, input_names=[],
                     output_names=["v1", "v2"])
    with pytest.raises(rt.InputError, match=r"sample time 0.02 s, the loop has 0.01 s"):
        rt.coupling.simulate(filters, disturbances=slow)
    nano = rt.Record(sample_time=0.01, inputs=np.zeros((50, 0)), outputs=v.T, input_names=[],
                     output_names=["v1", "v2"], units={"v1": "nm"})
    with pytest.raises(rt.InputError, match="v1 in nm"):
        rt.coupling.simulate(filters, disturbances=nano)


def test_bad_arguments() -> None:
    _, filters = designed(0, window=0.1)
    for arguments, words in (({"samples": 5}, "5 samples"), ({"samples": 0}, "samples = 0"),
                             ({"samples": 50, "on": 60}, "on = 60"), ({"samples": 50, "on": (9, 3)}, r"on = \(9, 3\)"),
                             ({"samples": 50, "on": True}, "on = True"),
                             ({"disturbances": (np.ones(20), np.ones(19))}, "not two traces"),
                             ({"disturbances": (np.ones(20), np.full(20, np.nan))}, "not two traces"),
                             ({"disturbances": 3.0}, "not two traces"),
                             ({"samples": 20, "disturbances": np.ones((2, 20))}, "samples = 20 and disturbances")):
        with pytest.raises(rt.InputError, match=words):
            rt.coupling.simulate(filters, **arguments)
    P, C = control.tf([1], [1, 1, 0], 0), control.tf([1.0], [1], 0)
    with pytest.raises(rt.InputError, match="continuous-time"):
        rt.coupling.simulate(rt.coupling.evaluate(P, P, C, C, X_hat=-0.1))


def test_plot_marks_the_switching() -> None:
    pytest.importorskip("matplotlib").use("Agg")
    _, filters = designed(0, window=0.1)
    axes = rt.coupling.simulate(filters, samples=60, on=(20, 40)).plot()
    assert axes.shape == (3,) and len(axes[0].lines) == 4
