"""A small table of materials at room temperature."""

from __future__ import annotations

import difflib
from dataclasses import astuple, dataclass, fields

from .._checks import positive_number
from .._pandas import pd
from ..errors import InputError

_INCROPERA = "Incropera and DeWitt, Fundamentals of Heat and Mass Transfer, appendix A, 300 K"


@dataclass(frozen=True)
class Material:
    """A solid.

    Parameters
    ----------
    name : str
        Name of the material, as messages show it.
    conductivity : float
        Thermal conductivity k [W/(m K)].
    density : float
        Mass per volume [kg/m³].
    specific_heat : float
        Specific heat capacity at constant pressure [J/(kg K)].
    source : str
        Where the numbers come from.
    conductivity_range : tuple of float, optional
        Spread between grades and sources [W/(m K)].

    Examples
    --------
    >>> import robthermal as rt
    >>> foam = rt.thermal.Material("foam", conductivity=0.03, density=30.0, specific_heat=1400.0, source="sheet")
    >>> foam.volumetric_heat
    42000.0
    """

    name: str
    conductivity: float
    density: float
    specific_heat: float
    source: str = ""
    conductivity_range: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        for field, unit in (("conductivity", "W/(m K)"), ("density", "kg/m³"), ("specific_heat", "J/(kg K)")):
            positive_number(getattr(self, field), f"material {self.name!r} {field}", unit)

    @property
    def volumetric_heat(self) -> float:
        """Heat capacity per volume [J/(m³ K)]."""
        return self.density * self.specific_heat


_TABLE = (
    Material("aluminium", 237.0, 2702.0, 903.0, _INCROPERA + ", pure"),
    Material("aluminium 6061", 167.0, 2700.0, 896.0, "mill data sheets, temper T6; the range is that of the tempers",
             (154.0, 180.0)),
    Material("copper", 401.0, 8933.0, 385.0, _INCROPERA + ", pure"),
    Material("brass", 110.0, 8530.0, 380.0, _INCROPERA + ", 70 % Cu, 30 % Zn"),
    Material("carbon steel", 60.5, 7854.0, 434.0, _INCROPERA + ", plain carbon", (43.0, 64.0)),
    Material("stainless 304", 14.9, 7900.0, 477.0, _INCROPERA),
    Material("stainless 316", 13.4, 8238.0, 468.0, _INCROPERA),
    Material("invar", 10.5, 8050.0, 515.0, "Carpenter data sheet, Invar 36", (10.0, 13.0)),
    Material("titanium Ti-6Al-4V", 6.7, 4430.0, 526.0, "mill data sheets, annealed; specific heat up to 560",
             (6.6, 7.3)),
    Material("silicon", 148.0, 2330.0, 712.0, _INCROPERA),
    Material("alumina", 36.0, 3970.0, 765.0, _INCROPERA + ", polycrystalline, dense; 96 % substrates are lower",
             (20.0, 36.0)),
    Material("fused silica", 1.38, 2220.0, 745.0, _INCROPERA),
    Material("glass", 1.4, 2500.0, 750.0, _INCROPERA + ", soda-lime plate", (0.9, 1.4)),
    Material("POM", 0.31, 1410.0, 1470.0, "typical of manufacturers' sheets, copolymer", (0.22, 0.39)),
    Material("PMMA", 0.19, 1180.0, 1470.0, "typical of manufacturers' sheets", (0.17, 0.21)),
    Material("PTFE", 0.25, 2200.0, 1000.0, "typical of manufacturers' sheets", (0.24, 0.35)),
)
_BY_NAME = {material.name: material for material in _TABLE}


def materials() -> pd.DataFrame:
    """Materials known by name, at room temperature.

    Conductivities of alloys, ceramics and plastics differ between grades by more than any model error: where the range
    is wide, put the conductance under [fit] and let data decide.

    Returns
    -------
    DataFrame
        Index: name. Columns: conductivity [W/(m K)], density [kg/m³], specific_heat [J/(kg K)], source,
        conductivity_range [W/(m K)].

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.thermal.materials().loc["POM", "conductivity_range"]
    (0.22, 0.39)
    """
    table = pd.DataFrame([astuple(m) for m in _TABLE], columns=[f.name for f in fields(Material)])
    return table.set_index("name")


def material_of(material: str | Material, where: str) -> Material:
    """The material itself, or the one of that name."""
    if isinstance(material, Material):
        return material
    if not isinstance(material, str) or material not in _BY_NAME:
        close = difflib.get_close_matches(str(material), _BY_NAME, n=1)
        hint = f"Did you mean {close[0]!r}? " if close else ""
        raise InputError(f"{material!r} is not in the table", where=where, expected="one of " + ", ".join(_BY_NAME),
                         remedy=hint + "Or give rt.thermal.Material(name, conductivity, density, specific_heat).")
    return _BY_NAME[material]
