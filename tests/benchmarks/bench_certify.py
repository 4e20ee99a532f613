"""Certificates: what they reach, how long finding and verifying takes, and a thousand random networks.

Run as a script; `--networks n` sets the number of random networks, `--large` adds networks of 10^5 and 10^6 lumps.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from itertools import product

import control
import numpy as np
from _timing import best_of, header, row
from scipy.linalg import expm, solve_discrete_are
from scipy.sparse import coo_array, csr_array, diags_array
from scipy.sparse.linalg import splu

import robthermal as rt

BOX = (278.15, 358.15)


def limits(system: rt.System) -> None:
    """Largest certified currents of the two-module set-up, all methods."""
    for method, direction in product(("energy", "sum", "max", "lyapunov"), ("symmetric", "cooling", "heating")):
        seconds, found = best_of(lambda method=method, direction=direction: rt.certify.largest_current(
            system, temperature=BOX, direction=direction, method=method), repeats=1)
        row(f"largest current, {method}, {direction}", seconds, f"{found.current:.3f} A")


def observers(system: rt.System) -> None:
    """Kalman gains on few and more sensors, heating."""
    eq = rt.thermal.Equations(system)
    A_d = expm(eq.A.toarray() / eq.capacity[:, None])
    for sensors, top in ((("T6", "T7"), 3.4), (("T6", "T7", "T13", "T16"), 4.0)):
        C = np.zeros((len(sensors), 18))
        for k, name in enumerate(sensors):
            C[k, system.lump_names.index(system.sensors[name].lump)] = 1.0
        R = 1e-4 * np.eye(len(sensors))
        P = solve_discrete_are(A_d.T, C.T, 1e-6 * np.eye(18), R)
        L = A_d @ P @ C.T @ np.linalg.inv(C @ P @ C.T + R)
        seconds, cert = best_of(lambda L=L, sensors=sensors, top=top: rt.certify.observer(
            system, gain=L, sensors=sensors, current=dict.fromkeys(system.modules, (-top, 0.0)), temperature=BOX),
            repeats=1)
        row(f"observer on {len(sensors)} sensors, heating to {top} A: search", seconds, f"holds {cert.holds}")
        row("  verification", best_of(lambda cert=cert: rt.verify(cert))[0])


def gains(system: rt.System) -> None:
    """Peak gains of every lump's load."""
    seconds, found = best_of(lambda: rt.certify.gains(system, current=dict.fromkeys(system.modules, (0.0, 1.5)),
                                                      temperature=BOX))
    row("peak gains, 19 disturbances: search", seconds, found.outcome.text)
    row("  verification", best_of(lambda: rt.verify(found.certificate))[0])


def chain(n: int) -> rt.System:
    """Two modules between two chains of lumps."""
    half = n // 2
    links = [{"between": (f"x{i}", f"x{i + 1}"), "conductance": 2.0} for i in range(n - 1) if i != half - 1]
    links += [{"between": (f"x{i}", "room"), "conductance": 0.05} for i in range(n)]
    module = {"seebeck": {"value": 0.05, "slope": 7e-5}, "resistance": {"value": 4.5, "slope": 0.02},
              "conductance": {"value": 0.3, "slope": 0.0}, "reference_temperature": 308.15}
    return rt.System(ambients={"room": {"temperature": 298.15}}, links=links,
                     lumps={f"x{i}": {"capacity": 5.0 + i % 7} for i in range(n)},
                     modules={f"m{k}": {**module, "hot": f"x{10 * k}", "cold": f"x{half + 10 * k}"} for k in (0, 1)})


def hundred_states() -> None:
    """A hundred lumps with a full matrix: verification of contraction and observer."""
    system = chain(100)
    current = dict.fromkeys(system.modules, (0.0, 1.0))
    cert = rt.certify.contraction(system, current=current, temperature=BOX, method="lyapunov", large=True)
    row("100 lumps, lyapunov: verification", best_of(lambda: rt.verify(cert), repeats=1)[0], f"valid {cert.holds}")


def regulated(system: rt.System) -> None:
    """Cold faces held at 5 °C: certified currents beside the runaway limit."""
    setpoint = dict.fromkeys(system.modules, 278.15)
    fold = rt.certify.runaway(system, setpoint=setpoint)
    row("runaway limit at 5 °C", 0.0, ", ".join(f"{name} {value:.3f} A" for name, value in fold.current.items()))
    for method in ("max", "sum"):
        seconds, found = best_of(lambda method=method: rt.certify.largest_regulated_current(
            system, setpoint=setpoint, temperature=(278.15, 328.15), method=method), repeats=1)
        row(f"regulated, {method}, other lumps 5 to 55 °C", seconds, f"{found.current:.3f} A")


def linear() -> None:
    """Norms of a linear system with twenty lightly damped modes, proven at every frequency."""
    system = modes(20)
    for name, run in (("stability", lambda: rt.certify.stability(system)),
                      ("H-infinity", lambda: rt.certify.hinf(system).certificate)):
        seconds, cert = best_of(run, repeats=1)
        row(f"40 states, {name}: search", seconds, f"holds {cert.holds}")
        row("  verification", best_of(lambda cert=cert: rt.verify(cert), repeats=1)[0])


def modes(count: int) -> control.StateSpace:
    """Sum of second-order modes, damping 0.5 %."""
    frequencies = np.geomspace(1.0, 100.0, count)
    A, B, C = np.zeros((2 * count, 2 * count)), np.zeros((2 * count, 1)), np.zeros((1, 2 * count))
    for k, w in enumerate(frequencies):
        A[2 * k:2 * k + 2, 2 * k:2 * k + 2] = [[0.0, w], [-w, -0.01 * w]]
        B[2 * k + 1], C[0, 2 * k] = 1.0, (-1.0) ** k
    return control.ss(A, B, C, 0)


def grid(k: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Neighbors in a k by k grid, and their conductances."""
    at = np.arange(k * k).reshape(k, k)
    a = np.concatenate([at[:, :-1].ravel(), at[:-1].ravel()])
    b = np.concatenate([at[:, 1:].ravel(), at[1:].ravel()])
    return a, b, rng.uniform(0.5, 2.0, a.size)


def million_lumps() -> None:
    """A network of 10^6 lumps beside one sparse solve of the same matrix."""
    rng = np.random.default_rng(0)
    a, b, g = grid(1000, rng)
    n = 1_000_000
    A = csr_array(coo_array((np.r_[g, g], (np.r_[a, b], np.r_[b, a])), shape=(n, n)))
    A = csr_array(A - diags_array(A.sum(axis=1) + rng.uniform(0, 0.01, n)))
    E = rng.uniform(1.0, 5.0, n)
    solve, _ = best_of(lambda: splu(A.tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True},
                                    diag_pivot_thresh=0.0).solve(-E), repeats=1)
    row("10^6 lumps: one sparse solve", solve)
    seconds, cert = best_of(lambda: rt.certify.network(E, A), repeats=1)
    check, verdict = best_of(lambda: rt.verify(cert), repeats=1)
    row("10^6 lumps: certificate", seconds, f"holds {cert.holds}")
    row("  verification", check, f"valid {verdict.valid}; together {(seconds + check) / solve:.2f} sparse solves")


def many_modules() -> None:
    """99 856 lumps with eight modules."""
    rng, k = np.random.default_rng(0), 316
    a, b, g = grid(k, rng)
    links = [{"between": (f"x{i}", f"x{j}"), "conductance": float(v)} for i, j, v in zip(a, b, g, strict=True)]
    links += [{"between": (f"x{i}", "room"), "conductance": float(v)}
              for i, v in enumerate(rng.uniform(0.001, 0.01, k * k))]
    module = {"seebeck": {"value": 0.05, "slope": 7e-5}, "resistance": {"value": 4.5, "slope": 0.02},
              "conductance": {"value": 0.3, "slope": 0.0}, "reference_temperature": 308.15}
    faces = rng.choice(k * k, 16, replace=False)
    system = rt.System(
        ambients={"room": {"temperature": 298.15}}, links=links,
        lumps={f"x{i}": {"capacity": float(c)} for i, c in enumerate(rng.uniform(1.0, 5.0, k * k))},
        modules={f"m{q}": {**module, "hot": f"x{faces[2 * q]}", "cold": f"x{faces[2 * q + 1]}"} for q in range(8)})
    seconds, cert = best_of(lambda: rt.certify.contraction(
        system, current=dict.fromkeys(system.modules, (0.0, 1.0)), temperature=BOX, method="sum"), repeats=1)
    row("99 856 lumps, 8 modules, sum: search", seconds, f"holds {cert.holds}")
    row("  verification", best_of(lambda: rt.verify(cert), repeats=1)[0])


def random_network(rng: np.random.Generator) -> rt.System:
    """One or two modules with slopes of either sign in a random tree."""
    n = int(rng.integers(4, 9))
    links = [{"between": (f"x{i}", f"x{int(rng.integers(i))}"), "conductance": rng.uniform(0.1, 5)}
             for i in range(1, n)]
    links += [{"between": (f"x{i}", "room"), "conductance": rng.uniform(0.01, 1)} for i in range(n)
              if i == 0 or rng.random() < 0.6]
    faces = rng.choice(n, 4, replace=False)
    modules = {f"m{k}": {"hot": f"x{faces[2 * k]}", "cold": f"x{faces[2 * k + 1]}", "reference_temperature": 300.0,
                         "seebeck": {"value": 0.05, "slope": rng.uniform(-3e-4, 3e-4)},
                         "resistance": {"value": 3.0, "slope": rng.uniform(-0.03, 0.03)},
                         "conductance": {"value": 0.3, "slope": rng.uniform(-2e-3, 2e-3)}}
               for k in range(int(rng.integers(1, 3)))}
    return rt.System(ambients={"room": {"temperature": 298.0}}, links=links, modules=modules,
                     lumps={f"x{i}": {"capacity": rng.uniform(1, 50)} for i in range(n)})


def growth(system: rt.System, span: tuple[float, float], rng: np.random.Generator) -> float:
    """Largest sampled real part of the frozen eigenvalues [1/s]: a lower bound of the truth."""
    eq, worst = rt.thermal.Equations(system), -np.inf
    u, m = eq.nominal(), len(system.modules)
    for k in range(60):
        x = rng.choice(BOX, len(system.lumps)) if k % 4 else rng.uniform(*BOX, len(system.lumps))
        u[:m] = rng.choice(span, m) if k % 3 else rng.uniform(*span, m)
        worst = max(worst, np.linalg.eigvals(eq.jacobian(x, u).toarray() / eq.capacity[:, None]).real.max())
    return float(worst)


def random_networks(count: int) -> int:
    """Certify random networks with every cheap method; count the wrongly certified."""
    rng, table = np.random.default_rng(2024), Counter()

    def run() -> None:
        for _ in range(count):
            system, top = random_network(rng), float(rng.uniform(2, 30))
            span = ((-top, top), (0.0, top), (-top, 0.0))[int(rng.integers(3))]
            unstable = growth(system, span, rng) >= 0
            for method in ("energy", "sum", "max"):
                cert = rt.certify.contraction(system, current=dict.fromkeys(system.modules, span), temperature=BOX,
                                              method=method)
                table["unstable" if unstable else "no instability seen", cert.holds] += 1

    seconds = best_of(run, repeats=1)[0]
    for (truth, holds), number in sorted(table.items()):
        row(f"{truth}, {'certified' if holds else 'not certified'}", seconds, f"{number} certificates")
    return table["unstable", True]


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--networks", type=int, default=1000)
    arguments.add_argument("--large", action="store_true")
    options = arguments.parse_args()
    header("Certificates")
    two = rt.systems.two_module()
    limits(two)
    regulated(two)
    observers(two)
    gains(two)
    hundred_states()
    linear()
    if options.large:
        million_lumps()
        many_modules()
    header("Random networks: none wrongly certified")
    sys.exit(1 if random_networks(options.networks) else 0)
