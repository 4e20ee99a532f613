"""C99 source of a current law I = I0 + F (x - x0), inside the ranges of the currents."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..export import Program, comment, doubles, identifier, rows
from ._modules import Array

_BEYOND = 8.0  # times the box: how far the test goes, so that the ranges of the currents are met

_ABOUT = """\
Current law, one sample every {h:.17g} s, the currents held in between:

    failed = {p}_step(temperature, current);     [K] -> [A]

current = I0 + F (temperature - x0), inside the ranges of the currents. Where a temperature is not a finite number the
currents of the operating point are returned, and 1: nothing is proven then.
Temperatures [K]: {lumps}. Currents [A]: {modules}.
{outcome}"""

_STEP = """
static inline int @_step(const double temperature[@_lumps], double current[@_modules])
{
    int failed = 0;
    for (int j = 0; j < @_lumps; j++)
        failed = failed || !(fabs(temperature[j]) < INFINITY);
    for (int i = 0; i < @_modules; i++) {
        double sum = @_current[i];
        for (int j = 0; !failed && j < @_lumps; j++)
            sum += @_gain[i][j] * (temperature[j] - @_at[j]);
        current[i] = fmin(fmax(sum, @_low[i]), @_high[i]);
    }
    return failed;
}
"""


def currents_program(gain: Array, temperatures: Mapping[str, float], currents: Mapping[str, float],
                     limits: Mapping[str, tuple[float, float]], box: Mapping[str, tuple[float, float]],
                     sample_time: float, name: str, outcome: str) -> Program:
    """C source; `box`: where temperatures of the test come from, {lump: (lower, upper)} [K]."""
    p, (m, n) = identifier(name, "controller"), gain.shape
    least, most = np.array([limits[one] for one in currents]).T.tolist()
    parts = [f"enum {{ {p}_lumps = {n}, {p}_modules = {m} }};",
             f"static const double {p}_gain[{m}][{n}] = {{\n{rows(gain.tolist())}\n}};"]
    for word, values in (("at", list(temperatures.values())), ("current", list(currents.values())), ("low", least),
                         ("high", most)):
        parts.append(f"static const double {p}_{word}[{len(values)}] = {doubles(values)};")
    about = _ABOUT.format(p=p, h=sample_time, lumps=comment(", ".join(temperatures)),
                          modules=comment(", ".join(currents)), outcome=outcome)
    rng = np.random.default_rng(0)
    vector = []
    for _ in range(64):
        x = [float(at + _BEYOND * rng.uniform(low - at, high - at))
             for at, (low, high) in ((temperatures[one], box[one]) for one in temperatures)]
        row = []
        for i, (own, start) in enumerate(currents.items()):
            total = start
            for a, value, at in zip(gain[i].tolist(), x, temperatures.values(), strict=True):
                total += a * (value - at)
            row.append(min(max(total, limits[own][0]), limits[own][1]))
        vector.append([*x, *row, 0.0])
    return Program(p, "CONTROLLER_TEST", about, "\n".join([*parts, _STEP.replace("@", p)]), vector, n, "",
                   f"        out[{m}] = {p}_step(in, out);", [*temperatures, *currents, "failed"])
