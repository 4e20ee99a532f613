"""The linearizing feedback law for other programs: C99, MATLAB and JSON."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from .._celsius import ZERO_CELSIUS
from ..export import Program, comment, doubles, identifier, write_export
from ._modules import Array, ModuleSet

FORMAT = "robthermal-law/1"
LIMITS = ("", "slew", "optimum", "voltage", "current", "fault")  # numbered as in the C source
_TEST_SAMPLES = 64
_TEST_STEP = 0.5  # s, sample time of the test vector

_ABOUT = """\
Feedback linearization of thermoelectric modules (Evers 2021, (5.15)-(5.18), corrected).

Modules, in this order: {names}. Positive current pumps heat from the cold to the hot face.

    faults = {p}_step(wanted, hot, cold, previous, h, current, voltage, achieved, limit);

wanted: heat into the cold faces [W], negative cools. hot, cold: temperatures of the faces [K], or their estimates.
previous: currents of the sample before [A], and h the time since then [s]; NULL if nothing limits the slew.
current [A], voltage [V]: one of them goes to the driver. achieved: heat with it [W], for the anti-windup.
limit: active limit, 0 none, 1 slew, 2 optimum (more current would cool less), 3 voltage, 4 current, 5 fault.
Fault: a number is not finite, a face is below 150 K, or S, R or K is not positive: then the module is switched off."""

_BODY = """\
/* Value at the reference temperature and slope of S [V/K], R [Ohm], K [W/K]; reference [K]; ranges [A], [V]; [A/s] */
typedef struct {{
    double S, S_slope, R, R_slope, K, K_slope, T_ref, current_low, current_high, voltage_low, voltage_high, slew;
}} {p}_module;

static const {p}_module {p}_modules[{m}] = {{
{modules}
}};

/* Held to a range; which says what held it. */
static inline double {p}_clip(double x, double low, double high, int by, int *which)
{{
    double y = x < low ? low : x;
    y = y > high ? high : y;
    if (y != x)
        *which = by;
    return y;
}}

static inline int {p}_step(const double wanted[{m}], const double hot[{m}], const double cold[{m}],
    const double *previous, double h, double current[{m}], double voltage[{m}], double achieved[{m}], int limit[{m}])
{{
    int faults = 0;
    for (int i = 0; i < {m}; i++) {{
        const {p}_module *p = &{p}_modules[i];
        double dT = 0.5 * (hot[i] + cold[i]) - p->T_ref, across = hot[i] - cold[i];
        double S = p->S + p->S_slope * dT, R = p->R + p->R_slope * dT, K = p->K + p->K_slope * dT;
        if (!(hot[i] >= 150.0 && cold[i] >= 150.0 && S > 0.0 && R > 0.0 && K > 0.0 && isfinite(hot[i] + cold[i])
              && isfinite(wanted[i]) && (previous == NULL || isfinite(previous[i])))) {{
            current[i] = voltage[i] = achieved[i] = 0.0;
            limit[i] = 5;
            faults++;
            continue;
        }}
        double leak = K * across, a = S * cold[i] / R; /* a: optimal current (5.18) */
        double least = leak - 0.5 * S * cold[i] * a;   /* (5.17) */
        double share = 2.0 * (wanted[i] - leak) / R;
        share = share < -a * a ? -a * a : share;
        double asked = -share / (a + sqrt(a * a + share)); /* the smaller root, without cancellation */
        int which = wanted[i] < least ? 2 : 0;
        double I = asked;
        if (previous != NULL)
            I = {p}_clip(I, previous[i] - p->slew * h, previous[i] + p->slew * h, 1, &which);
        I = {p}_clip(I, -INFINITY, a, 2, &which);
        I = {p}_clip(I, (p->voltage_low - S * across) / R, (p->voltage_high - S * across) / R, 3, &which);
        I = {p}_clip(I, p->current_low, p->current_high, 4, &which);
        double heat = wanted[i] > least ? wanted[i] : least;
        if (I != asked)
            heat = leak + 0.5 * R * I * I - S * cold[i] * I;
        current[i] = I;
        voltage[i] = S * across + R * I;
        achieved[i] = heat;
        limit[i] = heat == wanted[i] ? 0 : which;
    }}
    return faults;
}}
"""


class Law(Protocol):
    """What is written of a linearizing feedback law, see `FeedbackLinearization`."""

    @property
    def modules(self) -> ModuleSet:
        """Driven modules."""

    @property
    def names(self) -> tuple[str, ...]:
        """Their names, in the order of the heats."""

    @property
    def current_low(self) -> Array:
        """Smallest currents [A]."""

    @property
    def current_high(self) -> Array:
        """Largest currents [A]."""

    @property
    def voltage_low(self) -> Array:
        """Smallest voltages [V]."""

    @property
    def voltage_high(self) -> Array:
        """Largest voltages [V]."""

    @property
    def slew(self) -> Array:
        """Largest changes of current [A/s]."""

    def bounds(self, temperatures: Array) -> Any:
        """Coldest heats, for the test vector."""

    def command(self, v: Array, temperatures: Array, *, previous: Array | None = None,
                sample_time: float | None = None) -> Any:
        """Currents, voltages and heats, for the test vector."""


def export(law: Law, path: str | Path, name: str) -> None:
    """Write a .c, .h, .mat or .json file."""
    write_export(path, lambda: _document(law, name), lambda: _program(law, name))


def _rows(law: Law) -> dict[str, dict[str, float]]:
    """Numbers of every module, in the order of the C struct."""
    limits = (law.current_low, law.current_high, law.voltage_low, law.voltage_high, law.slew)
    keys = ("current_low", "current_high", "voltage_low", "voltage_high", "slew")
    found = {}
    for i, (name, part) in enumerate(zip(law.names, law.modules.parts, strict=True)):
        found[name] = {"S": part.seebeck.value, "S_slope": part.seebeck.slope, "R": part.resistance.value,
                       "R_slope": part.resistance.slope, "K": part.conductance.value,
                       "K_slope": part.conductance.slope, "T_ref": part.reference_temperature,
                       **{key: float(values[i]) for key, values in zip(keys, limits, strict=True)}}
    return found


def _document(law: Law, name: str) -> dict[str, Any]:
    """Module after module; a limit that is not there is infinite."""
    modules = [{"name": module, "hot": part.hot, "cold": part.cold, **row}
               for (module, row), part in zip(_rows(law).items(), law.modules.parts, strict=True)]
    return {"format": FORMAT, "name": name, "modules": modules}


def _program(law: Law, name: str) -> Program:
    """Inputs of the test: wanted, hot, cold, previous; outputs: current, voltage, achieved, limit."""
    p, m = identifier(name, "law"), len(law.names)
    body = _BODY.format(p=p, m=m, modules=",\n".join("    " + doubles(row.values()) for row in _rows(law).values()))
    call = (f"        {p}_step(in, in + {m}, in + {2 * m}, in + {3 * m}, {_TEST_STEP}, out, out + {m}, out + {2 * m}, "
            f"limit);\n        for (int k = 0; k < {m}; k++)\n            out[{3 * m} + k] = limit[k];")
    columns = [f"{what} {module}" for what in ("wanted", "hot", "cold", "previous", "current", "voltage", "achieved",
                                               "limit") for module in law.names]
    return Program(p, "LAW_TEST", _ABOUT.format(p=p, names=comment(", ".join(law.names))), body,
                   list(_test_vector(law)), 4 * m, f"    int limit[{m}];", call, columns)


def _test_vector(law: Law) -> Iterator[list[float]]:
    """Heats from beyond the coldest to beyond every heating limit; the slew limit is active in every other sample."""
    rng, m = np.random.default_rng(0), len(law.names)
    x = np.full(len(law.modules.system.lumps), 298.15)
    for t in range(_TEST_SAMPLES):
        x[law.modules.cold] = rng.uniform(ZERO_CELSIUS, 298.15, m)
        x[law.modules.hot] = rng.uniform(298.15, 318.15, m)
        wanted = rng.uniform(-1.2, 4.0 if t % 4 > 1 else 1.0, m) * np.abs(law.bounds(x).heat)
        free = law.command(wanted, x).current
        previous = free if t % 2 else rng.uniform(0.0, 2.0, m) * free
        done = law.command(wanted, x, previous=previous, sample_time=_TEST_STEP)
        codes = [float(LIMITS.index(limit)) for limit in done.limit]
        yield [*wanted, *x[law.modules.hot], *x[law.modules.cold], *previous, *done.current, *done.voltage, *done.heat,
               *codes]
