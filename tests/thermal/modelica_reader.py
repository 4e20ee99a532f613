"""A tiny reader of Modelica models: declarations, equations, and their values along a simulation."""

from __future__ import annotations

import math
import operator
import re

import numpy as np
from scipy.integrate import solve_ivp

TOKEN = re.compile(r"\s*([A-Za-z]\w*|\d+\.?\d*(?:[eE][+-]?\d+)?|>=|[-+*/^(),])")
OPERATIONS = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv, "^": operator.pow}
FUNCTIONS = {"max": max, "min": min, "abs": abs, "sin": math.sin, "noEvent": lambda x: x,
             "sign": lambda x: (x > 0) - (x < 0)}


class Model:
    """Text of one flat model, taken apart by the grammar of Modelica 3.6, appendix A, as far as it is used here."""

    def __init__(self, text: str):
        found = re.fullmatch(r'model (\w+) "[^"]*"\n(.*)initial equation\n(.*)\nequation\n(.*)end \1;\n', text, re.S)
        assert found, "no model"
        self.name, declared, initial, equations = found.groups()
        self.kind, self.parameters = {}, {}
        for line in declared.strip().splitlines():
            parts = re.fullmatch(r'\s*(parameter |input |output |)Real ([A-Za-z]\w*)(\(unit="[^"]*"\))?'
                                 r'( = -?[\d.e+-]+)?( "[^"]*")?;', line)
            assert parts, line
            kind, name, _, value, _ = parts.groups()
            assert name not in self.kind, f"{name} is declared twice"
            assert bool(value) == (kind == "parameter "), line
            self.kind[name] = kind.strip()
            if value:
                self.parameters[name] = float(value[3:])
        self.initial = [self._equation(line) for line in initial.splitlines() if line.strip()]
        self.equations = [self._equation(line) for line in equations.splitlines() if line.strip()]
        self.rates, self.values = {}, {}
        for left, right in self.equations:
            if left[0] == "name":
                self.values[left[1]] = right
            else:  # coefficient * der(state)
                assert left[0] == "*" and left[1][0] == "name" and left[2][0] == "der", left
                self.rates[left[2][1][1]] = (left[1], right)
        self.unknowns = [name for name, kind in self.kind.items() if kind in ("", "output")]

    def _equation(self, line):
        left, right = line.strip().removesuffix(";").split(" = ")
        assert line.endswith(";"), line
        return parse(left), parse(right)

    def run(self, times, inputs):
        """Values of all unknowns at times; inputs is a function of time that holds its value between the times."""
        states, history = list(self.rates), {}

        def late(tree, t):  # what is delayed has no memory of its own here: inputs, or a state of the finished run
            values = dict(zip(states, history["at"](t), strict=True)) if history else {}
            return self.value(tree, t, values, inputs, late, times[0])

        start = {}
        for left, right in self.initial:
            start[left[1]] = self.value(right, times[0], start, inputs, late, times[0])
        assert sorted(start) == sorted(states), "one initial equation per state"

        def slope(t, z):
            values = dict(zip(states, z, strict=True))
            return [self.value(right, t, values, inputs, late, times[0])
                    / self.value(left, t, values, inputs, late, times[0]) for left, right in self.rates.values()]

        z, pieces = np.array([start[name] for name in states]), []
        for a, b in zip(times[:-1], times[1:], strict=True):
            pieces.append(solve_ivp(lambda t, z, end=b: slope(min(t, end - 1e-9), z), (a, b), z, rtol=1e-8, atol=1e-8,
                                    dense_output=True, method="LSODA").sol)
            z = pieces[-1](b)
        history["at"] = lambda t: pieces[min(int(np.searchsorted(times, t, "right")) - 1, len(pieces) - 1)](t)
        return {name: [self.value(("name", name), t, dict(zip(states, history["at"](t), strict=True)), inputs, late,
                                  times[0]) for t in times] for name in self.unknowns}

    def value(self, tree, t, values, inputs, late, first):
        """Value of an expression."""
        def of(inner):
            return self.value(inner, t, values, inputs, late, first)

        match tree:
            case ("number", x):
                return x
            case ("name", "time"):
                return t
            case ("name", name) if name in values:
                return values[name]
            case ("name", name) if name in self.parameters:
                return self.parameters[name]
            case ("name", name) if self.kind[name] == "input":
                return inputs(t)[name]
            case ("name", name):
                return of(self.values[name])
            case ("delay", inner, length):
                return late(inner, max(t - of(length), first))
            case ("if", condition, yes, no):
                return of(yes) if of(condition) else of(no)
            case (">=", a, b):
                return of(a) >= of(b)
            case ("negative", a):
                return -of(a)
            case (("+" | "-" | "*" | "/" | "^") as sign, a, b):
                return OPERATIONS[sign](of(a), of(b))
            case (function, *arguments):
                return FUNCTIONS[function](*map(of, arguments))


def parse(text):
    """Expression as nested tuples."""
    words, at = [], 0
    while at < len(text.rstrip()):
        found = TOKEN.match(text, at)
        assert found, text[at:]
        words.append(found[1])
        at = found.end()
    tree = expression(words)
    assert not words, f"left over in {text}: {words}"
    return tree


def expression(words):
    if words[:1] == ["if"]:
        words.pop(0)
        condition = expression(words)
        assert words.pop(0) == "then"
        yes = expression(words)
        assert words.pop(0) == "else"
        return ("if", condition, yes, expression(words))
    left = arithmetic(words)
    return (words.pop(0), left, arithmetic(words)) if words[:1] == [">="] else left


def arithmetic(words):
    sign = words.pop(0) if words[0] in "+-" else "+"
    left = ("negative", term(words)) if sign == "-" else term(words)
    while words and words[0] in "+-":
        left = (words.pop(0), left, term(words))
    return left


def term(words):
    left = factor(words)
    while words and words[0] in "*/":
        left = (words.pop(0), left, factor(words))
    return left


def factor(words):
    base = primary(words)
    if words[:1] == ["^"]:
        words.pop(0)
        return ("^", base, primary(words))
    return base


def primary(words):
    word = words.pop(0)
    if word == "(":
        inner = expression(words)
        assert words.pop(0) == ")"
        return inner
    if word[0].isdigit():
        return ("number", float(word))
    assert word[0].isalpha(), word
    if words[:1] != ["("]:
        return ("name", word)
    words.pop(0)
    arguments = [expression(words)]
    while words[0] == ",":
        words.pop(0)
        arguments.append(expression(words))
    assert words.pop(0) == ")"
    return (word, *arguments)
