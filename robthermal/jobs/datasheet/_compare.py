"""Modules side by side: both inversions of every sheet, and what each does at one operating point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from ..._celsius import HIGHEST_CELSIUS, ZERO_CELSIUS
from ..._pandas import pd
from ...errors import InputError
from ...thermal import (
    Inversion,
    ModulePoint,
    Rating,
    SheetInversion,
    SinkSize,
    invert_datasheet,
    module_point,
    size_sink,
)
from ._sheets import Sheets

Basis = Literal["voltage", "heat"]


@dataclass(frozen=True)
class WantedPoint:
    """Operating point at which modules are compared.

    Parameters
    ----------
    cold : float
        Temperature of the cold face [K].
    hot : float, optional
        Temperature of the hot face [K]; or `ambient` instead.
    ambient : float, optional
        Temperature around the heat sink [K]: the largest thermal resistance of the sink is found.
    load : float, optional
        Heat to absorb [W].
    current : float, optional
        Current instead of a load, between two faces of known temperature [A].
    sink : float, optional
        Thermal resistance of a heat sink [K/W]: the operating point on it is found.

    Raises
    ------
    InputError
        Values that do not make one operating point.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.jobs.datasheet.WantedPoint(cold=283.15, ambient=298.15, load=8.0).hot is None
    True
    """

    cold: float
    hot: float | None = None
    ambient: float | None = None
    load: float | None = None
    current: float | None = None
    sink: float | None = None

    def __post_init__(self) -> None:
        if (self.hot is None) == (self.ambient is None):
            raise InputError("hot side and ambient are both given" if self.hot is not None else
                             "neither a hot side nor an ambient is given", where="--hot, --ambient",
                             expected="one of them", remedy="--hot: of the hot face; --ambient: around its heat sink.")
        if (self.load is None) == (self.current is None):
            raise InputError("load and current are both given" if self.load is not None else
                             "neither a load nor a current is given", where="--load, --current", expected="one of them")
        if self.ambient is not None and self.load is None:
            raise InputError("a sink is sized for a load", where="--current", expected="--load [W]")
        if self.sink is not None and self.ambient is None:
            raise InputError("a sink needs the temperature around it", where="--sink", expected="--ambient instead of "
                             "--hot")


@dataclass(frozen=True)
class ComparedModule:
    """One module of a comparison.

    Parameters
    ----------
    name : str
        Name of the module.
    sheet : SheetInversion
        Both inversions of its datasheet.
    point : ModulePoint or None
        Operating point; None where none was asked for.
    size : SinkSize or None
        Heat sink that it needs; None where no ambient was given.
    """

    name: str
    sheet: SheetInversion
    point: ModulePoint | None
    size: SinkSize | None

    @property
    def holds(self) -> bool:
        """Whether the operating point is held, if one was asked for."""
        return self.point is None or bool(self.point.outcome)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the operating point is beyond: the currents of the sheet, cooling."""
        if self.point is None:
            return ()
        current, largest = abs(self.point.current), max(rating.i_max for rating in self.sheet.ratings)
        found = []
        if current > largest:
            found.append(f"{current:.4g} A are {current / largest:.3g} times the Imax of the sheet, {largest:.4g} A: "
                         "beyond it nothing of the sheet was measured.")
        if self.point.load < 0.0:
            found.append(f"The load is negative: the cold face gives off {-self.point.load:.4g} W, nothing is cooled.")
        return tuple(found)


@dataclass(frozen=True)
class ModuleComparison:
    """Modules side by side.

    Parameters
    ----------
    modules : tuple of ComparedModule
        In the order in which they were given.
    basis : {"voltage", "heat"}
        Which inversion the operating points are of.
    """

    modules: tuple[ComparedModule, ...]
    basis: Basis

    def table(self) -> pd.DataFrame:
        """Properties of all modules, both inversions.

        Returns
        -------
        pandas.DataFrame
            Index: module and basis; columns as in `SheetInversion.table`.
        """
        return pd.concat({one.name: one.sheet.table() for one in self.modules}, names=["module", "basis"])

    def misfits(self) -> pd.DataFrame:
        """Misfit of every number of every sheet [%].

        Returns
        -------
        pandas.DataFrame
            As `SheetInversion.misfits`, with the module in front.
        """
        return pd.concat([one.sheet.misfits().assign(module=one.name) for one in self.modules], ignore_index=True)[
            ["module", "basis", "Th [°C]", "Vmax [%]", "Imax [%]", "dTmax [%]", "Qmax [%]"]]

    def points(self) -> pd.DataFrame:
        """Operating points of all modules; empty where none was asked for.

        Returns
        -------
        pandas.DataFrame
            Columns: module, held, cold [°C], hot [°C], load [W], current [A], voltage [V], power [W], COP, rejected
            [W], and with an ambient the largest thermal resistance of the sink [K/W].
        """
        rows: list[dict[str, Any]] = []
        for one in self.modules:
            if one.point is not None:
                p = one.point
                rows.append({"module": one.name, "held": bool(p.outcome), "cold [°C]": p.cold - ZERO_CELSIUS,
                             "hot [°C]": p.hot - ZERO_CELSIUS, "load [W]": p.load, "current [A]": p.current,
                             "voltage [V]": p.voltage, "power [W]": p.power, "COP": p.cop, "rejected [W]": p.rejected,
                             **({} if one.size is None else {"largest sink [K/W]": one.size.resistance})})
        return pd.DataFrame(rows)

    def to_dict(self) -> dict[str, Any]:
        """Everything, ready for JSON.

        Returns
        -------
        dict
        """
        return {"basis": self.basis, "modules": [_plain(one) for one in self.modules]}

    def __str__(self) -> str:
        shown = "{:.5g}".format
        parts = [self.table().to_string(float_format=shown),
                 "misfit of every number of the sheet, predicted / sheet - 1:",
                 self.misfits().to_string(index=False, float_format="{:+.1f}".format)]
        parts += [f"{one.name}: {one.sheet.outcome.text}" for one in self.modules]
        points = self.points()
        if len(points):
            parts += [f"operating point, properties from {'Vmax' if self.basis == 'voltage' else 'Qmax'}:",
                      points.to_string(index=False, float_format=shown)]
            parts += [f"{one.name}: {one.point.outcome.text}" for one in self.modules
                      if one.point is not None and not one.point.outcome]
            parts += [f"{one.name}: {' '.join(one.notes)}" for one in self.modules if one.notes]
            if any(one.size is not None for one in self.modules):
                parts.append("At the largest thermal resistance there is no margin: beyond it the module runs away "
                             "thermally. Without --sink the point is the one there.")
        return "\n".join(parts)


def compare_modules(sheets: Mapping[str, tuple[Rating, ...]] | Sheets, wanted: WantedPoint | None = None,
                    basis: Basis = "voltage") -> ModuleComparison:
    """Invert datasheets, and compare the modules at an operating point.

    Parameters
    ----------
    sheets : mapping
        Name to the columns of its datasheet, as `read_sheets` gives them.
    wanted : WantedPoint, optional
        Where to compare them; without it only the properties are found.
    basis : {"voltage", "heat"}
        Which inversion the operating points are of.

    Returns
    -------
    ModuleComparison

    Raises
    ------
    InputError
        "heat" where a sheet has no Qmax; temperatures that are no kelvin.

    Examples
    --------
    >>> import robthermal as rt
    >>> sheets = rt.jobs.datasheet.read_sheets(["TM 127-1.4-4.0", "RMT 1MC06-126-03"])
    >>> wanted = rt.jobs.datasheet.WantedPoint(cold=283.15, ambient=298.15, load=8.0)
    >>> found = rt.jobs.datasheet.compare_modules(sheets, wanted)
    >>> [round(one.size.resistance, 2) for one in found.modules]
    [1.25, 0.79]
    """
    found = []
    for name, ratings in sheets.items():
        try:
            sheet = invert_datasheet(ratings)
            chosen = sheet.by(basis)
        except InputError as error:
            raise InputError(error.what, where=f"datasheet of {name}", expected=error.expected,
                             remedy=error.remedy) from None
        found.append(ComparedModule(name, sheet, *_at(chosen, wanted)))
    return ModuleComparison(tuple(found), basis)


def wanted_in_celsius(*, cold: float | None, hot: float | None, ambient: float | None, load: float | None,
                      current: float | None, sink: float | None) -> WantedPoint | None:
    """Operating point from values in degrees Celsius; None if nothing was said of one.

    Parameters
    ----------
    cold, hot, ambient : float, optional
        Temperatures as in `WantedPoint`, but in degrees Celsius [°C].
    load, current, sink : float, optional
        As in `WantedPoint` [W], [A], [K/W].
    """
    given = {"--cold": cold, "--hot": hot, "--ambient": ambient, "--load": load, "--current": current, "--sink": sink}
    said = [option for option, value in given.items() if value is not None]
    if not said:
        return None
    if cold is None:
        raise InputError(f"{said[0]} is given without the cold face", where="--cold", expected="its temperature [°C]")
    for option, value in {"--cold": cold, "--hot": hot, "--ambient": ambient}.items():
        if value is not None and value > HIGHEST_CELSIUS:
            raise InputError(f"{value:g} °C is above {HIGHEST_CELSIUS:g} °C: it looks like kelvin", where=option,
                             expected="degrees Celsius", remedy=f"Write {value - ZERO_CELSIUS:g}.")
    return WantedPoint(cold + ZERO_CELSIUS, None if hot is None else hot + ZERO_CELSIUS,
                       None if ambient is None else ambient + ZERO_CELSIUS, load, current, sink)


def checked_basis(text: str) -> Basis:
    """One of the two inversions by its name.

    Parameters
    ----------
    text : str
        "voltage" or "heat".
    """
    if text == "voltage":
        return "voltage"
    if text == "heat":
        return "heat"
    raise InputError(f"{text!r}", where="--basis", expected='"voltage" or "heat"', remedy="Choose one of them.")


def _at(chosen: Inversion, wanted: WantedPoint | None) -> tuple[ModulePoint | None, SinkSize | None]:
    if wanted is None:
        return None, None
    if wanted.hot is not None:
        return module_point(chosen.properties, hot=wanted.hot, cold=wanted.cold, load=wanted.load,
                            current=wanted.current), None
    size = size_sink(chosen.properties, cold=wanted.cold, ambient=wanted.ambient or 0.0, load=wanted.load or 0.0)
    return size.limit if wanted.sink is None else size.point(wanted.sink), size


def _plain(one: ComparedModule) -> dict[str, Any]:
    point = one.point
    return {
        "name": one.name, "ratings": [vars(rating) for rating in one.sheet.ratings],
        "voltage": _properties(one.sheet.voltage),
        "heat": None if one.sheet.heat is None else _properties(one.sheet.heat),
        "outcome": vars(one.sheet.outcome),
        "point": None if point is None else {**{key: value for key, value in vars(point).items() if key != "outcome"},
                                             "power": point.power, "cop": point.cop if point.power else None,
                                             "outcome": vars(point.outcome)},
        "notes": list(one.notes),
        "largest_sink": None if one.size is None else one.size.resistance}


def _properties(one: Inversion) -> dict[str, Any]:
    p = one.properties
    return {"seebeck": vars(p.seebeck), "resistance": vars(p.resistance), "conductance": vars(p.conductance),
            "reference_temperature": p.reference_temperature,
            "misfits": [{key: None if value != value else value for key, value in off.items()} for off in one.misfits]}
