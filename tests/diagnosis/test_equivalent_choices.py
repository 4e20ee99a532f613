"""Answers that hold whichever way a user starts: other records, other starting values, a pair of names for a pair.

The truth is a board with two heaters and a path between them, late thermometers or late heaters, by scipy's matrix
exponential.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.linalg import expm

import robthermal as rt
from robthermal.diagnosis import Entry, Refit
from robthermal.diagnosis._judge import Validation
from robthermal.diagnosis._rivals import predicting
from robthermal.diagnosis.evidence import hold_out, validation_data
from robthermal.diagnosis.fit import coarsened, exact, extended, only_heated
from robthermal.diagnosis.search import Accepted, begin, refit_short_list, without_contradicted
from robthermal.diagnosis.search._exchange import with_exchanged

H, ROOM, LATE, PATH, C = 5.0, 295.0, 20.0, 0.004, 2.0


def board(path: bool = False, *, late: bool = False, disturbance: float = 0.0) -> rt.System:
    """What a user draws: each heater loses heat to the room, and that is all."""
    heaters = {"heater_1": ("Q1", 0.012, "T1"), "heater_2": ("Q2", 0.006, "T2")}
    links = [{"between": (name, "room"), "conductance": 8e-3} for name in heaters]
    fit = {f"links.{name}-room.conductance": {"lower": 1e-4, "upper": 0.05} for name in heaters}
    fit |= {f"inputs.{q}.gain": {"lower": 1e-3, "upper": 0.1} for q, _, _ in heaters.values()}
    if path:
        links.append({"between": ("heater_1", "heater_2"), "conductance": 3e-3})
        fit["links.heater_1-heater_2.conductance"] = {"lower": 0.0, "upper": 0.05}
    lag = {"time_constant": 15.0} if late else {}
    fit |= {f"sensors.{s}.time_constant": {"lower": 0.1, "upper": 60.0} for _, _, s in heaters.values() if late}
    return rt.System(ambients={"room": {"temperature": ROOM}}, links=links, fit=fit,
                     lumps={name: {"capacity": C, "disturbance": disturbance} for name in heaters},
                     inputs={q: {"lump": name, "gain": gain} for name, (q, gain, _) in heaters.items()},
                     sensors={s: {"lump": name, "noise": 0.1, **lag} for name, (_, _, s) in heaters.items()})


def measured(u: np.ndarray, seed: int, *, late: float = LATE, path: float = PATH, loss: float = 9e-3) -> rt.Record:
    """Both late thermometers, from rest, with a column of the room."""
    A = np.zeros((4, 4))
    A[:2, :2] = np.array([[-loss - path, path], [path, -8e-3 - path]]) / C
    A[2:, :2], A[2:, 2:] = np.eye(2) / late, -np.eye(2) / late
    B = np.zeros((4, 2))
    B[:2] = np.diag([0.0117, 0.0055]) / C
    M = expm(H * np.block([[A, B], [np.zeros((2, 6))]]))[:4]
    rng, x, rows = np.random.default_rng(seed), np.zeros(4), []
    for row in u:
        rows.append(x[2:])
        x = M @ [*x, *row]
    readings = ROOM + np.array(rows) + 0.1 * rng.standard_normal((len(u), 2))
    return rt.Record(sample_time=H, inputs=np.column_stack([u, np.full(len(u), ROOM)]), outputs=readings,
                     input_names=["Q1", "Q2", "room"], output_names=["T1", "T2"], name=f"run {seed}",
                     start_time=1e5 * seed)


def stairs(seed: int, n: int = 300) -> np.ndarray:
    return np.repeat(np.random.default_rng(seed).uniform(0.0, 90.0, (n // 10, 2)), 10, axis=0)


def step(level: float, seed: int, path: float = PATH) -> rt.Record:
    """A step of heater 1, heater 2 off, the room not recorded."""
    return measured(np.tile([level, 0.0], (120, 1)), seed, path=path).select(inputs=["Q1", "Q2"])


def other_day(path: float = PATH) -> rt.Record:
    """Heater 1 in steps, heater 2 off, the room not recorded."""
    return measured(stairs(9) * [1.0, 0.0], 9, path=path).select(inputs=["Q1", "Q2"])


def steps() -> list[rt.Record]:
    return [step(level, seed) for seed, level in enumerate((20.0, 60.0, 100.0), start=1)]


@cache
def one_heater() -> Refit:
    """The board without its path, its room no warmer than beside a machine that is only heated."""
    return only_heated(rt.diagnosis.refit(board(), steps()))


@cache
def entry(fit: Refit, effect: str) -> Entry:
    return refit_short_list(fit, rt.diagnosis.score(fit, [effect])).entries[0]


def together(fit: Refit, *names: tuple[str, str]) -> Refit:
    """Lags of some parts, refitted."""
    for effect, part in names:
        one = next(c for c in rt.diagnosis.candidates(fit.structure.base, [effect]) if c.where == (part,))
        structure = fit.structure.with_effect(one)
        values = [*fit.structure.quantities(fit.v), {"time_constant": 15.0}]
        fit = extended(fit, structure, structure.carried(fit.structure, fit.v, values))
    return fit


def test_a_path_is_found_from_where_its_absence_has_put_a_conductance_at_its_bound() -> None:
    """Nothing heats heater 2 in the model: it is tied to the room, and the linearization asks for a millionth of that.

    The refit stood still at 30 times the sum of squares, and constant heats were named in its place.
    """
    nominal = one_heater()
    assert nominal.system.parameter("links.heater_2-room.conductance") == pytest.approx(0.05)
    right = only_heated(rt.diagnosis.refit(board(path=True), steps(), nominal.floor))
    found = entry(nominal, "missing_link")
    assert found.fit.rss < 1.1 * right.rss < 0.01 * nominal.rss
    assert found.found["conductance"] == pytest.approx(right.system.parameter("links.heater_1-heater_2.conductance"),
                                                       rel=0.05)


def test_late_thermometers_may_be_late_heaters_if_both_are() -> None:
    """Beside one late heater the other thermometer is no late one: the records decide for the pair, if they can."""
    nominal = rt.diagnosis.refit(board(path=True), measured(stairs(4), 4))
    late = {heater: (("input_lag", f"Q{heater}"), ("sensor_lag", f"T{heater}")) for heater in (1, 2)}
    fit = together(nominal, late[1][0], late[2][0])
    mixed = [together(nominal, late[1][a], late[2][1 - a]) for a in (0, 1)]
    assert all(one.rss > fit.rss + 50.0 for one in mixed)
    rounds = tuple(Accepted(nominal, best=Entry(fit.structure.effects[at], fit, 100.0, 0.0),
                            beaten=(Entry(mixed[1 - at].structure.effects[at], mixed[1 - at], 50.0, 0.0),))
                   for at in (0, 1))
    found = with_exchanged(rounds, fit, ())
    for at, one in enumerate(found):
        assert one.best is rounds[at].best
        assert [entry.candidate.key for entry in one.contenders] == [("sensor_lag", (f"T{at + 1}",))]
    alone = with_exchanged(tuple(replace(one, beaten=()) for one in rounds), fit, ())
    assert [one.contenders for one in alone] == [(), ()]


def test_the_lag_of_the_only_heater_may_be_that_of_all_thermometers() -> None:
    nominal = rt.diagnosis.refit(board(path=True), steps())
    fit = together(nominal, ("input_lag", "Q1"))
    late = Accepted(nominal, best=Entry(fit.structure.effects[0], fit, 100.0, 0.0))
    (found,) = with_exchanged((late,), fit, ())
    assert {entry.candidate.key for entry in found.contenders} == {("sensor_lag", ("T1",)), ("sensor_lag", ("T2",))}
    (asked,) = with_exchanged((late,), fit, (), ("input_lag",))
    assert asked.contenders == ()  # a user who excludes lags of sensors is told of none
    both = rt.diagnosis.refit(board(path=True), measured(stairs(4), 4))
    fit = together(both, ("input_lag", "Q1"))
    (other,) = with_exchanged((Accepted(both, best=Entry(fit.structure.effects[0], fit, 100.0, 0.0)),), fit, ())
    assert other.contenders == ()  # heater 2 moves as well


def test_validation_records_choose_a_rival_that_training_records_put_second() -> None:
    nominal = one_heater()
    path, other = entry(nominal, "missing_link"), entry(nominal, "heat_source")
    wrong = Accepted(nominal, best=other, contenders=(path,))
    state = replace(begin(nominal, ["missing_link"]), rounds=(wrong,), fit=other.fit)
    held_out = Validation(other_day())
    chosen = predicting(state, nominal, held_out)
    assert chosen is not None and chosen.rounds[0].best is path and chosen.fit is path.fit
    assert predicting(chosen, nominal, held_out) is None  # it predicts: nothing takes its place
    assert predicting(state, nominal, Validation(None)) is None


def test_what_the_free_run_needs_is_not_contradicted(monkeypatch: pytest.MonkeyPatch) -> None:
    """A density with a wrong random heat speaks against the path; the validation error is many times larger without."""
    nominal = one_heater()
    path = entry(nominal, "missing_link")
    rounds = (Accepted(nominal, best=path),)
    monkeypatch.setattr("robthermal.diagnosis.search._contradicted.negative_log_predictive_density",
                        lambda fits, *_: [100.0 * (fit is path.fit) for fit in fits])
    data = validation_data(path.fit, other_day(), None)
    assert without_contradicted(rounds, path.fit, nominal, data) == (rounds, path.fit)
    no_path = validation_data(path.fit, other_day(path=0.0), None)
    assert without_contradicted(rounds, path.fit, nominal, no_path) == ((), nominal)


def test_the_free_run_is_that_of_networks_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a finer network changes is in no free run: fits beside one would be compared without it."""
    nominal = coarsened(rt.diagnosis.refit(board(path=True), measured(stairs(4), 4)))
    lag = entry(nominal, "sensor_lag")
    data = validation_data(lag.fit, measured(stairs(5), 5), None)
    compared = []

    def watched(less: Refit, fit: Refit, records: list[rt.Record]) -> object:
        compared.append((less, fit))
        return hold_out(less, fit, records)

    monkeypatch.setattr("robthermal.diagnosis.search._contradicted.hold_out", watched)
    monkeypatch.setattr("robthermal.diagnosis.search._contradicted.negative_log_predictive_density",
                        lambda fits, *_: [100.0 * (fit is lag.fit) for fit in fits])
    rounds = (Accepted(nominal, best=lag),)
    assert without_contradicted(rounds, lag.fit, nominal, data) == (rounds, lag.fit)
    assert nominal.structure.n_coarse > 0 and compared == [(exact(nominal), exact(lag.fit))]


def test_days_of_a_machine_with_late_thermometers_are_compared() -> None:
    """Where lags begin settled there are fewer unknowns than with a start in motion: the comparison ended there."""
    days = [measured(stairs(seed, 100), seed, loss=9e-3 * (1.0 + 0.02 * (-1) ** seed)) for seed in range(1, 5)]
    found = rt.diagnose(board(path=True, late=True), days[-1], reference=days[:-1], effects=["heat_source"])
    assert found.verdict == "consistent"
