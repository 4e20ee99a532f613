"""Certificates: what they reach, how long finding and verifying takes, and a thousand random networks."""

from __future__ import annotations

import sys
from collections import Counter
from itertools import product

import numpy as np
from _timing import best_of, header, row
from scipy.linalg import expm, solve_discrete_are

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
    header("Certificates")
    two = rt.systems.two_module()
    limits(two)
    observers(two)
    gains(two)
    hundred_states()
    header("Random networks: none wrongly certified")
    sys.exit(1 if random_networks(int(sys.argv[1]) if len(sys.argv) > 1 else 1000) else 0)
