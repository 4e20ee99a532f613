"""Protection of modules for other programs: C99 with a test vector, MATLAB and JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

from ..export import Program, comment, doubles, identifier, write_export
from ._protection_rules import CLEAR, ProtectionRules, Watch, step

FORMAT = "robthermal-protection/1"

_ABOUT = """\
Protection of thermoelectric modules: switches a module off whose readings contradict its current.

Modules, in this order: {names}. Positive current pumps heat from the cold to the hot face.

    {p}_init(&state);
    tripped = {p}_step(&state, h, current, hot, cold, reference, ambient, idle, trip);

h: time since the sample before [s]. current: asked for [A]. hot, cold: temperatures of the faces [K]. reference:
set-points of the cold faces [K]. ambient: the warmest [K]. idle: 1 where nothing of the machine is driven.
trip: 0 none, 1 reading, 2 hot, 3 polarity, 4 runaway, 5 stuck. What is not 0 stays until {p}_init: send no current."""

_BODY = """\
/* Currents [A] from which polarity and runaway are judged; delay [s], change [K]; rest [s]; rise, ends [K] */
typedef struct {{
    double current, full, delay, change, rest, rise, coldest, hottest;
}} {p}_rules;

static const {p}_rules {p}_modules[{m}] = {{
{modules}
}};

typedef struct {{
    double rested, started, sign, across, full_cold, full_hot, lowest;
    int full, idle, trip;
}} {p}_watch;

typedef struct {{
    {p}_watch of[{m}];
}} {p}_state;

static inline void {p}_init({p}_state *s)
{{
    for (int i = 0; i < {m}; i++) {{
        {p}_watch fresh = {{{p}_modules[i].rest, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0, 0}};
        s->of[i] = fresh;
    }}
}}

static inline int {p}_one(const {p}_rules *p, {p}_watch *w, double h, double current, double hot, double cold,
    double reference, double ambient, int idle)
{{
    if (w->trip)
        return w->trip;
    if (!(p->coldest <= hot && p->coldest <= cold && isfinite(hot + cold + current)))
        return 1;
    if (hot > p->hottest || cold > p->hottest)
        return 2;
    double sign = current > 0.0 ? 1.0 : -1.0, across = hot - cold;
    if (!(fabs(current) >= p->current)) {{
        w->rested += h;
        w->started = -1.0;
    }} else if (w->rested >= p->rest) {{ /* a start after a rest */
        w->rested = w->started = 0.0;
        w->sign = sign;
        w->across = across;
    }} else {{
        w->rested = 0.0;
        w->started = w->started >= 0.0 && sign == w->sign ? w->started + h : -1.0;
    }}
    if (w->started >= p->delay) {{
        if (w->sign * (across - w->across) < -p->change)
            return 3;
        w->started = -1.0;
    }}
    int full = current >= p->full && cold > reference;
    if (full && w->full && cold - w->full_cold > p->rise && hot - w->full_hot > p->rise)
        return 4;
    if (full && !w->full) {{
        w->full_cold = cold;
        w->full_hot = hot;
    }}
    double warmest = hot > cold ? hot : cold;
    double lowest = w->idle && w->lowest < warmest ? w->lowest : warmest;
    if (idle && warmest > ambient + {clear} && warmest - lowest > p->rise)
        return 5;
    w->full = full;
    w->idle = idle;
    w->lowest = lowest;
    return 0;
}}

static inline int {p}_step({p}_state *s, double h, const double current[{m}], const double hot[{m}],
    const double cold[{m}], const double reference[{m}], double ambient, int idle, int trip[{m}])
{{
    int tripped = 0;
    for (int i = 0; i < {m}; i++) {{
        s->of[i].trip = trip[i] = {p}_one(&{p}_modules[i], &s->of[i], h, current[i], hot[i], cold[i], reference[i],
            ambient, idle);
        tripped += trip[i] != 0;
    }}
    return tripped;
}}
"""


class Guard(Protocol):
    """What is written of a protection, see `Protection`."""

    @property
    def names(self) -> tuple[str, ...]:
        """Protected modules."""

    @property
    def rules(self) -> tuple[ProtectionRules, ...]:
        """Rules of every module."""


def export_protection(guard: Guard, path: str | Path, name: str) -> None:
    """Write a .c, .h, .mat or .json file."""
    write_export(path, lambda: _document(guard, name), lambda: _program(guard, name))


def _document(guard: Guard, name: str) -> dict[str, Any]:
    modules = [{"name": module, **vars(rules)} for module, rules in zip(guard.names, guard.rules, strict=True)]
    return {"format": FORMAT, "name": name, "clear": CLEAR, "modules": modules}


def _program(guard: Guard, name: str) -> Program:
    """Inputs of the test: reset, idle, ambient, h, current, hot, cold, reference of every module; outputs: trips."""
    p, m = identifier(name, "protection"), len(guard.names)
    rows = ",\n".join("    " + doubles(vars(rules).values()) for rules in guard.rules)
    body = _BODY.format(p=p, m=m, modules=rows, clear=CLEAR)
    call = (f"        if (in[0] != 0.0)\n            {p}_init(&state);\n"
            f"        {p}_step(&state, in[3], in + 4, in + {4 + m}, in + {4 + 2 * m}, in + {4 + 3 * m}, in[2], "
            f"in[1] != 0.0, trip);\n        for (int k = 0; k < {m}; k++)\n            out[k] = trip[k];")
    columns = ["reset", "idle", "ambient", "h"] + [f"{what} {module}" for what in ("current", "hot", "cold",
                                                   "reference", "trip") for module in guard.names]
    return Program(p, "PROTECTION_TEST", _ABOUT.format(p=p, names=comment(", ".join(guard.names))), body,
                   list(_test_vector(guard.rules)), 4 + 4 * m, f"    {p}_state state;\n    int trip[{m}];", call,
                   columns)


def _test_vector(rules: Sequence[ProtectionRules]) -> Iterator[list[float]]:
    """A healthy start, then every reason to trip, in this order; each from a fresh state."""
    for which in range(6):
        watches = [Watch(one.rest) for one in rules]
        for k in range(12):
            h = rules[0].delay / 4.0
            idle = which == 5 and k > 1
            seen = [_scene(one, which, k) for one in rules]
            watches = [step(one, watch, h, *scene, _ROOM, idle)
                       for one, watch, scene in zip(rules, watches, seen, strict=True)]
            yield [float(k == 0), float(idle), _ROOM, h, *(value for column in zip(*seen, strict=True)
                                                           for value in column), *(float(w.trip) for w in watches)]


_ROOM = 295.0  # K, ambient of the test vector


def _scene(rules: ProtectionRules, which: int, k: int) -> tuple[float, float, float, float]:
    """Current, hot, cold and reference of one sample of the test vector."""
    grown = rules.change * 0.5 * k
    if which == 1 and k == 7:
        return rules.current, float("inf"), _ROOM, _ROOM - 10.0
    if which == 2:
        return rules.current, rules.hottest - 6.0 + k, _ROOM, _ROOM - 10.0
    if which == 3:  # the faces part the wrong way
        return rules.current, _ROOM - grown, _ROOM + grown, _ROOM - 10.0
    if which == 4:  # both faces warm at full current
        return rules.full, _ROOM + 20.0 + 0.2 * rules.rise * k, _ROOM + 0.15 * rules.rise * k, _ROOM - 10.0
    if which == 5:  # nothing is driven, and it warms
        return (rules.current if k < 2 else 0.0), _ROOM + 0.25 * rules.rise * k, _ROOM, _ROOM - 10.0
    return rules.current, _ROOM + grown, _ROOM - grown, _ROOM - 10.0
