"""Losses of a healthy machine by natural convection: taken where its records ask for them, and only there.

The truth is a plate of two bodies and a sink, integrated by scipy.
"""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import robthermal as rt
from robthermal.diagnosis._own_names import in_own_names
from robthermal.diagnosis.change import convection_of
from robthermal.jobs.diagnose import Diagnosed, diagnosis_report

H, N, ROOM, NOISE = 20.0, 400, 295.0, 0.02
C, INSIDE, LOSSES = np.array([60.0, 90.0, 200.0]), (0.8, 1.1), np.array([0.05, 0.08, 0.5])
SYSTEM = rt.System(
    ambients={"room": {"temperature": ROOM}},
    lumps={name: {"capacity": c} for name, c in zip(("a", "b", "sink"), C, strict=True)},
    links=[{"between": ("a", "b"), "conductance": 0.8}, {"between": ("b", "sink"), "conductance": 1.1},
           *({"between": (name, "room"), "conductance": G}
             for name, G in zip(("a", "b", "sink"), LOSSES, strict=True))],
    inputs={"q": {"lump": "a"}}, sensors={f"T_{name}": {"lump": name, "noise": NOISE} for name in ("a", "b", "sink")},
    fit={f"links.{name}.conductance": {"lower": G / 4.0, "upper": 4.0 * G, "sigma": 0.2 * G} for name, G in
         (("a-b", 0.8), ("b-sink", 1.1), ("a-room", 0.05), ("b-room", 0.08), ("sink-room", 0.5))})
FEW = ["heat_source", "missing_ambient_link", "sensor_offset"]


@cache
def day(seed: int, exponents: tuple[float, float, float], inside: tuple[float, float] = INSIDE, fan: float = 1.0,
        lacks: str = "") -> rt.Record:
    """Every conductance of the day is off by 2 %; losses G (|ΔT| / 10 K)^n ΔT, that of the sink times `fan`."""
    rng = np.random.default_rng(seed)
    q = np.repeat(rng.choice([0.0, 6.0, 15.0, 25.0], N // 20), 20)
    off = np.exp(0.02 * rng.standard_normal(5))
    G, L = np.array(inside) * off[:2], LOSSES * off[2:] * np.array([1.0, 1.0, fan])

    def rate(t: float, T: np.ndarray) -> np.ndarray:
        loss = L * (np.abs(T - ROOM) / 10.0 + 1e-12) ** np.array(exponents) * (T - ROOM)
        a, b = G[0] * (T[0] - T[1]), G[1] * (T[1] - T[2])
        power = q[min(int(t / H), N - 1)] * (1.0 - 0.004 * (T[0] - ROOM) * (lacks == "heater_power_slope"))
        path = 0.15 * (T[0] - T[2]) * (lacks == "missing_link")
        loss = loss + np.array([1e-9, 1e-9, 3e-9]) * (T**4 - ROOM**4) * (lacks == "radiation")
        return np.array([power - a - path, a - b, b + path]) / C - loss / C

    T, rows = np.full(3, ROOM), []
    for k in range(N):
        rows.append(T)
        T = solve_ivp(rate, (k * H, k * H + H - 1e-9), T, rtol=1e-8, atol=1e-8).y[:, -1]
    return rt.Record(sample_time=H, inputs=q, outputs=np.array(rows) + NOISE * rng.standard_normal((N, 3)),
                     input_names=["q"], output_names=["T_a", "T_b", "T_sink"], start_time=1e5 * seed)


def asked(exponents: tuple[float, float, float], lacks: str = "") -> Any:
    records = [day(seed, exponents, lacks=lacks) for seed in (1, 2)]
    return convection_of(SYSTEM, lambda system: rt.diagnosis.refit(system, records))


@pytest.mark.parametrize("lacks", ["", "heater_power_slope", "missing_link", "radiation"])
def test_constant_conductances_stay_constant_whatever_else_is_missing(lacks: str) -> None:
    assert asked((0.0, 0.0, 0.0), lacks) is None


def test_losses_by_natural_convection_are_seen() -> None:
    law = asked((0.25, 0.25, 0.25))
    assert set(law.links) == {"a-room", "b-room", "sink-room"} and law.rms < 0.5 * law.without
    assert rt.thermal.constant_losses(law.system) == ()


def test_the_part_that_a_fan_cools_stays_constant() -> None:
    law = asked((0.25, 0.25, 0.0))
    assert law.links == ("a-room", "b-room") and law.rms < 0.5 * law.without
    assert rt.thermal.constant_losses(law.system) == ("sink-room",)


def test_a_model_that_runs_away_with_it_keeps_its_conductances() -> None:
    asked_for = []

    def fitted(system: rt.System) -> rt.diagnosis.Refit:
        asked_for.append(rt.thermal.constant_losses(system))
        if not rt.thermal.constant_losses(system):
            raise rt.errors.Diverged("a model runs away", time=0.0)
        return rt.diagnosis.refit(system, [day(1, (0.25,) * 3)])

    assert convection_of(SYSTEM, fitted) is None and asked_for[-1] == ()


@pytest.fixture(scope="module")
def loose() -> rt.diagnosis.Diagnosis:
    healthy = [day(seed, (0.25,) * 3) for seed in (1, 2, 3)]
    return rt.diagnose(SYSTEM, day(11, (0.25,) * 3, (0.8, 0.6)), reference=healthy, effects=FEW)


def test_a_contact_that_came_loose_is_named_beside_them(loose: rt.diagnosis.Diagnosis) -> None:
    assert [one.where for one in loose.effects] == [("links.b-sink.conductance",)] and loose.alternatives == ((),)
    assert loose.effects[0].values["relative"][0] == pytest.approx(0.6 / 1.1 - 1.0, abs=0.1)


def test_the_answer_says_how_losses_were_taken(loose: rt.diagnosis.Diagnosis) -> None:
    law = loose.reference.convection
    said = loose.to_dict()["reference"]["convection"]
    assert said == {"links": list(law.links), "exponent": 0.25, "rms_without": law.without, "rms": law.rms}
    assert str(law) in loose.outcome.text and str(law) in loose.caveats and "sink-room" in str(law)
    assert loose.system.parameter("links.sink-room.natural.gain") > 0.0
    assert str(law) in diagnosis_report(Diagnosed(loose, (), (), ())).headline


def test_a_weaker_loss_has_the_name_that_the_user_gave_it() -> None:
    """The fit table has conductances: so do effects, candidates and what is said of the reference records."""
    healthy = [day(seed, (0.25,) * 3) for seed in (1, 2, 3)]
    found = rt.diagnose(SYSTEM, day(11, (0.25,) * 3, fan=0.5), reference=healthy, effects=FEW)
    assert found.reference.convection is not None
    (one,) = found.effects
    assert (one.effect, one.where) == ("parameter_change", ("links.sink-room.conductance",))
    assert one.values["relative"][0] == pytest.approx(-0.5, abs=0.05)
    assert set(found.reference.scatter) == set(found.reference.deviation) == set(SYSTEM.fit)
    assert one.label in [candidate.label for candidate in found.scores.candidates]
    report = diagnosis_report(Diagnosed(found, (), (), ()))
    assert "the conductance of link sink-room is" in report.headline
    assert "natural.gain" not in json.dumps(found.to_dict()) + found.outcome.text + str(found)
    seen = rt.diagnose(SYSTEM, day(12, (0.25,) * 3), reference=healthy, effects=FEW)
    assert seen.verdict == "consistent" and set(SYSTEM.fit) <= set(seen.reference.visible)


def test_labels_in_text_are_those_of_the_user(loose: rt.diagnosis.Diagnosis) -> None:
    told = replace(loose, nearest="Nearest comes parameter_change(links.a-room.natural.gain): no name.",
                   alternatives=((("parameter_change", ("links.a-room.natural.gain",)), ("heat_source", ("a",))),),
                   not_testable={("parameter_change", ("links.b-room.natural.gain",)): "hidden"})
    own = in_own_names(told, loose.reference.convection)
    assert own.nearest == "Nearest comes parameter_change(links.a-room.conductance): no name."
    assert own.alternatives == ((("parameter_change", ("links.a-room.conductance",)), ("heat_source", ("a",))),)
    assert list(own.not_testable) == [("parameter_change", ("links.b-room.conductance",))]


def test_parameters_that_were_asked_for_are_not_replaced() -> None:
    found = rt.diagnose(SYSTEM, day(11, (0.25,) * 3, (0.8, 0.6)), reference=[day(seed, (0.25,) * 3) for seed in (1, 2)],
                        parameters=["links.sink-room.conductance", "links.b-sink.conductance"], effects=FEW)
    assert found.reference.convection is None and "convection" not in found.to_dict()["reference"]
