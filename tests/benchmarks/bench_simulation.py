"""48 h of the two-module system at 1 s against scipy's solve_ivp, and a network of 100 000 lumps.

Current and ambient change at every sample. The peers restart at every change with the analytic Jacobian, as one does
with a general-purpose integrator; they are run on the first part of the record and scaled by the number of samples
(their cost per sample does not depend on where they are). Accuracy is against a tight implicit Runge-Kutta run.
"""

import resource
import sys
import time

import numpy as np
from _timing import best_of, header, row
from blind import plants
from scipy.integrate import solve_ivp

import robthermal as rt
from robthermal.thermal import _fixed_point
from robthermal.thermal._effect_parts import Step

HOURS, PART, TIGHT = 48, 1500, 400


def drive(n, seed=0):
    """Random-walk currents and ambient that change at every sample."""
    rng = np.random.default_rng(seed)
    current = np.clip(0.5 + np.cumsum(rng.normal(0, 0.05, (n, 2)), axis=0) + rng.normal(0, 0.2, (n, 2)), -0.5, 1.5)
    room = 298.15 + np.sin(np.arange(n) / 3000) + rng.normal(0, 0.02, n)
    return rt.Record(sample_time=1.0, inputs=np.column_stack([current, room]), outputs=np.zeros((n, 0)),
                     input_names=["m1", "m2", "room"], output_names=[])


def peer(system, record, n, method, rtol, atol):
    """solve_ivp restarted at every sample; temperatures and wall time."""
    eq = rt.thermal.Equations(system)
    term = eq.terms[0]
    A, B = eq.A.toarray() / eq.capacity[:, None], eq.B.toarray() / eq.capacity[:, None]
    hot, cold, E = term.a, term.b, eq.capacity

    def rate(t, x, u, current):
        into_hot, into_cold = term.heat(x[hot], x[cold], current)
        dx = A @ x + B @ u
        dx[hot] += into_hot / E[hot]
        dx[cold] += into_cold / E[cold]
        return dx

    def jacobian(t, x, u, current):
        s = term.slopes(x[hot], x[cold], current)
        J = A.copy()
        J[hot, hot] += s.aa / E[hot]
        J[hot, cold] += s.ab / E[hot]
        J[cold, hot] += s.ba / E[cold]
        J[cold, cold] += s.bb / E[cold]
        return J

    x = [eq.initial()]
    u = record.inputs
    start = time.perf_counter()
    for k in range(n):
        x.append(solve_ivp(rate, (0.0, 1.0), x[-1], method=method, rtol=rtol, atol=atol, jac=jacobian,
                           args=(u[k], u[k, :2]), t_eval=[1.0]).y[:, -1])
    return np.array(x), time.perf_counter() - start


def embedded():
    """The two-module comparison."""
    header(f"{HOURS} h of the two-module system at 1 s, inputs change at every sample")
    system, record = rt.systems.two_module(), drive(HOURS * 3600)
    tight, _ = peer(system, record, TIGHT, "Radau", 1e-10, 1e-10)
    start = time.perf_counter()
    run = rt.thermal.trajectory(system, record, initial=rt.thermal.Equations(system).initial())
    ours = time.perf_counter() - start
    error = np.abs(run.lumps[:TIGHT + 1] - tight).max()
    row(f"robthermal, {record.n_samples} samples", ours, f"largest error {1e3 * error:.2g} mK against the tight run")
    for method in ("LSODA", "BDF"):
        for rtol, atol in ((1e-6, 1e-4), (1e-5, 1e-3), (1e-3, 1e-3)):
            x, seconds = peer(system, record, PART, method, rtol, atol)
            scaled = seconds / PART * record.n_samples
            error = np.abs(x[:TIGHT + 1] - tight).max()
            row(f"{method}, rtol {rtol:g}, atol {atol:g}: scaled from {PART} samples", scaled,
                f"error {1e3 * error:.2g} mK, {scaled / ours:.0f} times robthermal")


def steps_of_a_conductance():
    """A link that changes by a multiple of itself in the middle of an hour at 3 s, with and without mixing."""
    eight = plants.two_modules()
    inputs = plants.excitation(eight, plants.N_TRAIN, np.random.default_rng(0))
    currents = np.random.default_rng(0).uniform(-1.0, 1.5, (plants.N_TRAIN // 40, 2)).repeat(40, axis=0)
    air = np.full(plants.N_TRAIN, 298.15)
    _step_of("two-module system", rt.systems.two_module(), ["x3", "x6"], np.column_stack([currents, air]),
             ["m1", "m2", "room"])
    _step_of("plant B of the blind suite", plants.nominal(eight, dict.fromkeys(eight.sensors, 0.01), {}),
             ["left", "cold1"], inputs, eight.columns)


def _step_of(name, base, pair, inputs, columns):
    header(f"1 h of the {name} at 3 s, the link {'-'.join(pair)} changes at half time")
    record = rt.Record(sample_time=3.0, inputs=inputs, outputs=np.zeros((len(inputs), 0)), input_names=columns,
                       output_names=[])
    slow = _fixed_point._SLOW
    for relative in (0.3, -0.9, 3.0, 20.0):
        step = Step(relative=relative, time=1801.0)
        links = [link.model_copy(update={"step": step}) if set(link.between) == set(pair) else link
                 for link in base.links]
        system = base.model_copy(update={"links": links})
        ours, run = best_of(lambda system=system: rt.thermal.trajectory(system, record))
        _fixed_point._SLOW = np.inf
        picard, other = best_of(lambda system=system: rt.thermal.trajectory(system, record))
        _fixed_point._SLOW = slow
        apart = np.abs(run.lumps - other.lumps).max()
        row(f"robthermal, by {relative:+g} of itself", ours,
            f"Picard alone {picard:.3f} s, {picard / ours:.1f} times; {1e3 * apart:.2g} mK apart")


def network(side=316, steps=1000):
    """A plate of side x side lumps, heated by steps, cooled at the rim."""
    header(f"network of {side * side} lumps, {steps} steps")
    number = np.arange(side * side).reshape(side, side)
    right, down = np.c_[number[:, :-1].ravel(), number[:, 1:].ravel()], np.c_[number[:-1].ravel(), number[1:].ravel()]
    pairs = np.concatenate([right, down])
    rim = np.unique(np.concatenate([number[0], number[-1], number[:, 0], number[:, -1]]))
    links = [{"between": (f"x{a}", f"x{b}"), "conductance": 2.0} for a, b in pairs]
    links += [{"between": (f"x{i}", "room"), "conductance": 0.1} for i in rim]
    middle = f"x{number[side // 2, side // 2]}"
    start = time.perf_counter()
    system = rt.System(ambients={"room": {"temperature": 293.15}},
                       lumps={f"x{i}": {"capacity": 1.0} for i in number.ravel()},
                       links=links, inputs={"laser": {"lump": middle}}, sensors={"T": {"lump": middle}})
    row("build the System", time.perf_counter() - start, f"{len(links)} links")
    rng = np.random.default_rng(1)
    power = np.repeat(rng.uniform(0, 20, steps // 20), 20)
    record = rt.Record(sample_time=1.0, inputs=power, outputs=np.zeros((steps, 0)), input_names=["laser"],
                       output_names=[])
    start = time.perf_counter()
    run = rt.thermal.simulate(system, record, tolerance=1e-3)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    row(f"simulate {steps} samples", time.perf_counter() - start,
        f"peak memory {peak:.0f} MB, T rises by {run['T'].max() - 293.15:.2f} K")


if __name__ == "__main__":
    embedded()
    steps_of_a_conductance()
    if "--no-network" not in sys.argv:
        network()
