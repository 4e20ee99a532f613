"""Largest certified currents and runaway limits of the two-module setup beside the published reference table."""

import sys
import time
from pathlib import Path

import numpy as np
from _timing import best_of, header, row

import robthermal as rt

sys.path.insert(0, str(Path(__file__).parents[1] / "certify"))

BOX = (278.15, 358.15)
DIRECTIONS = ("symmetric", "cooling", "heating")
PUBLISHED = {  # corrected thesis, "Largest |I| certified on the 18-lump setup" [A]
    ("S(T), R(T)", "energy"): (2.72, 5.51, 2.72), ("S(T), R(T)", "sum"): (2.54, 5.54, 2.72),
    ("S(T), R(T)", "max"): (2.18, 5.22, 2.62), ("constant", "energy"): (4.93, 17.04, 4.93),
    ("constant", "sum"): (4.10, 13.5, 4.58), ("constant", "max"): (4.10, 13.5, 4.58)}
RUNAWAY = {5: (1.51, 3.75), 15: (1.54, 6.45), 25: (1.56, 9.18)}


def systems():
    """The setup with varying and with constant S and R."""
    two = rt.systems.two_module()
    flat = {f"modules.{m}.{p}.slope": 0.0 for m in two.modules for p in ("seebeck", "resistance")}
    return {"S(T), R(T)": two, "constant": two.with_parameters(flat)}


def limits():
    """Every entry of the table, with the time to find and to verify it."""
    header("largest certified current, box 5 to 85 °C: found (published) [A]")
    for (kind, method), published in PUBLISHED.items():
        system = systems()[kind]
        for direction, expected in zip(DIRECTIONS, published, strict=True):
            seconds, limit = best_of(lambda s=system, d=direction, m=method: rt.certify.largest_current(
                s, temperature=BOX, direction=d, method=m), repeats=1)
            check, verdict = best_of(lambda c=limit.certificate: rt.verify(c))
            row(f"{kind:<10} {method:<6} {direction:<9} {limit.current:7.3f} ({expected:5.2f})", seconds,
                f"verified in {1e3 * check:.1f} ms: {verdict.valid}")


def folds():
    """Runaway limits."""
    header("runaway limit per module: found (published)")
    system = systems()["S(T), R(T)"]
    for celsius, (current, load) in RUNAWAY.items():
        point = {m: celsius + 273.15 for m in system.modules}
        seconds, found = best_of(lambda p=point: rt.certify.runaway(system, setpoint=p), repeats=1)
        amps, watts = (", ".join(f"{v:.3f}" for v in d.values()) for d in (found.current, found.load))
        row(f"{celsius} °C: I* {amps} A ({current}), q* {watts} W ({load})", seconds)


def closed_forms(machines=40):
    """Fold of random single-module machines with constant properties against the root of the cubic."""
    header(f"fold against the closed form, {machines} random machines with one module")
    rng = np.random.default_rng(0)
    worst = 0.0
    start = time.perf_counter()
    for _ in range(machines):
        S, R, K, w = rng.uniform([0.01, 0.5, 0.05, 285], [0.1, 8, 1.5, 315])
        g, cold = 10 ** rng.uniform(-1, 1), w + rng.uniform(-35, 15)
        module = {"hot": "h", "cold": "c", "seebeck": S, "resistance": R, "conductance": K}
        links = [{"between": ("h", "w"), "conductance": g}, {"between": ("c", "w"), "conductance": 0.02}]
        system = rt.System(ambients={"w": {"temperature": w}}, links=links, modules={"m": module},
                           lumps={"h": {"capacity": 10.0}, "c": {"capacity": 5.0}})
        found = rt.certify.runaway(system, setpoint={"m": cold})
        worst = max(worst, abs(found.current["m"] / found.closed_form["m"] - 1))
    row(f"largest relative difference {worst:.1e}", time.perf_counter() - start)


def usable():
    """Usable currents of the setup, with and without ranges of its parameters."""
    header("usable current, box up to 85 °C: current, what limits it, the four bounds [A]")
    two = rt.systems.two_module()
    points = dict.fromkeys(two.modules, 278.15)
    ranges = {f"modules.{m}.{p}.value": (0.98 * getattr(module, p).value, 1.02 * getattr(module, p).value)
              for m, module in two.modules.items() for p in ("seebeck", "resistance", "conductance")}
    for text, options in (("cooling", {}), ("cooling, set-points 5 °C", {"setpoint": points}),
                          ("heating", {"direction": "heating"}), ("symmetric", {"direction": "symmetric"}),
                          ("cooling, 6 parameters ± 2 %", {"parameters": ranges})):
        seconds, found = best_of(lambda o=options: rt.certify.usable_current(
            two, temperature=BOX, lower="reported", **o), repeats=1)
        bounds = ", ".join(f"{bound.current:.3f}" for bound in found.limits.values())
        row(f"{text:<28} {found.current:.3f} {found.limited_by:<9} ({bounds})", seconds)


def ratios(machines=30):
    """Usable currents of random machines against what an own simulation of constant currents bears."""
    from random_machines import machine, simulated_limit

    header(f"{machines} random machines: usable current / smallest of simulated box limit, coldest state and rating")
    rng, found, seconds = np.random.default_rng(0), [], []
    for _ in range(machines):
        case = machine(rng)
        start = time.perf_counter()
        usable = rt.certify.usable_current(case.system, temperature=case.temperature, ambient=case.ambient,
                                           heat=case.heat, lower=case.lower)
        seconds.append(time.perf_counter() - start)
        others = min(usable.limits["runaway"].current, usable.limits["rating"].current, 30.0)
        found.append(usable.current / simulated_limit(case, others))
    low, tenth, median = np.quantile(found, [0.0, 0.1, 0.5])
    row(f"least {low:.2f}, tenth percentile {tenth:.2f}, median {median:.2f}, below 0.7: "
        f"{np.sum(np.array(found) < 0.7)}; longest search {max(seconds):.1f} s", float(np.sum(seconds)))


def conditions():
    """A map of 90 conditions on one process."""
    header("map of 90 conditions, one process")
    seconds, found = best_of(lambda: rt.certify.limit_map(
        rt.systems.two_module(), ambient=np.linspace(288.15, 308.15, 5), setpoint=np.linspace(278.15, 298.15, 3),
        load=np.linspace(0, 3.75, 6), temperature=(273.15, 358.15), jobs=1), repeats=1)
    row(found.outcome.text, seconds)


if __name__ == "__main__":
    limits()
    folds()
    closed_forms()
    usable()
    ratios()
    conditions()
