"""Modelica text under construction: every name once, one equation per unknown."""

from __future__ import annotations

import re

_RESERVED = frozenset(
    "abs algorithm and annotation assert block break cardinality change class connect connector constant "
    "constrainedby cos delay der discrete each edge else elseif elsewhen encapsulated end enumeration equation "
    "expandable extends external false final flow for function homotopy if import impure in initial inner input "
    "integer loop max min mod model noevent not operator or outer output package parameter partial pre protected "
    "public pure real record redeclare reinit replaceable return sample semilinear sign sin smooth spatial stream "
    "string terminal terminate then time true type when while within Real Integer Boolean String noEvent".split())


class Text:
    """A model under construction; whatever is added gets a name of its own.

    Parameters
    ----------
    title : str
        Comment that describes the model.
    name : str
        Its name, before the characters that Modelica does not allow become underscores.
    """

    def __init__(self, title: str, name: str):
        self._title = title
        self._names: dict[str, str] = {}
        self._taken = set(_RESERVED)
        self._known: dict[str, str] = {}
        self._declarations: list[str] = []
        self._initial: list[str] = []
        self._equations: list[str] = []
        self.name = self._new(name)

    def __getitem__(self, key: str) -> str:
        """Modelica name of a name of the system."""
        return self._names[key]

    def know(self, key: str, expression: str) -> None:
        """Remember what stands for something.

        Parameters
        ----------
        key, expression : str
            What, and the name that stands for it.
        """
        self._known[key] = expression

    def known(self, key: str, otherwise: str = "") -> str:
        """What stands for something, else the name of a column.

        Parameters
        ----------
        key, otherwise : str
            As in `know`, and a name of the system.
        """
        return self._known.get(key) or self[otherwise]

    def column(self, kind: str, key: str, unit: str, comment: str) -> None:
        """An input or output.

        Parameters
        ----------
        kind : str
            "input" or "output".
        key, unit, comment : str
            Name in the system, unit, and what it is.
        """
        self._names[key] = self._new(key)
        self._declare(f"{kind} Real {self[key]}", unit, "", comment)

    def state(self, key: str, unit: str, start: float, comment: str) -> None:
        """A temperature with its initial value.

        Parameters
        ----------
        key, unit, comment : str
            As in `column`.
        start : float
            At the start; the user may change it.
        """
        self._names[key] = self._new(key)
        self._declare(f"Real {self[key]}", unit, "", comment)
        self._initial.append(f"{self[key]} = {self.parameter(f'{key}_start', start, unit)}")

    def parameter(self, key: str, value: float, unit: str = "", comment: str = "") -> str:
        """A number; returns its name.

        Parameters
        ----------
        key, unit, comment : str
            Wanted name, unit, and what it is.
        value : float
            Numerical value in that unit.
        """
        name = self._new(key)
        self._declare(f"parameter Real {name}", unit, f" = {float(value)!r}", comment)
        return name

    def variable(self, key: str, unit: str, expression: str, comment: str = "") -> str:
        """An unknown with the equation that gives it; returns its name.

        Parameters
        ----------
        key, unit, comment : str
            As in `column`.
        expression : str
            What it equals.
        """
        name = self._new(key)
        self._declare(f"Real {name}", unit, "", comment)
        self.equation(f"{name} = {expression}")
        return name

    def lag(self, key: str, unit: str, time_constant: str, source: str, start: str) -> str:
        """A state that follows a source; returns its name.

        Parameters
        ----------
        key, unit : str
            As in `column`.
        time_constant, source, start : str
            Modelica expressions of time constant, source and initial value.
        """
        name = self._new(key)
        self._declare(f"Real {name}", unit, "", "")
        self._initial.append(f"{name} = {start}")
        self.equation(f"{time_constant} * der({name}) = {source} - {name}")
        return name

    def equation(self, text: str) -> None:
        """One more equation.

        Parameters
        ----------
        text : str
            Left and right side.
        """
        self._equations.append(text)

    def model(self) -> str:
        """The whole text."""
        lines = [f'model {self.name} "{_comment(self._title)}"', *(f"  {line};" for line in self._declarations),
                 "initial equation", *(f"  {line};" for line in self._initial),
                 "equation", *(f"  {line};" for line in self._equations), f"end {self.name};"]
        return "\n".join(lines) + "\n"

    def _declare(self, what: str, unit: str, value: str, comment: str) -> None:
        self._declarations.append(what + (f'(unit="{unit}")' if unit else "") + value
                                  + (f' "{_comment(comment)}"' if comment else ""))

    def _new(self, wanted: str) -> str:
        """A name that Modelica allows and nothing else has."""
        word = re.sub(r"[^0-9A-Za-z_]", "_", wanted)
        word = word if re.match(r"[A-Za-z]", word) else f"n_{word}"
        name, count = word, 1
        while name in self._taken:
            count += 1
            name = f"{word}_{count}"
        self._taken.add(name)
        return name


def _comment(text: str) -> str:
    """Inside of a Modelica string."""
    return re.sub(r"[^ -~]", "_", text).replace("\\", "/").replace('"', "'")
