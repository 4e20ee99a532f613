"""Thermal systems from geometry: rods and stacks cut into lumps, joints, films, and the Biot number of each lump."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from .._checks import positive_number, whole_number
from .._pandas import pd
from ..errors import InputError
from ._checks import kelvin, non_negative
from ._materials import Material, material_of
from ._parts import Link
from ._system import System

_BIOT = 0.1  # Evers (5.6): above it a lump is not of uniform temperature


@dataclass(frozen=True)
class Layer:
    """One layer of a stack.

    Parameters
    ----------
    name : str
        Its lumps are called name1, name2, …
    thickness : float
        Thickness of the layer, along the heat flow [m].
    material : str or Material
        Of `materials`, or your own.
    lumps : int
        Into how many lumps it is cut [-].
    """

    name: str
    thickness: float
    material: str | Material
    lumps: int = 1


@dataclass(frozen=True)
class Contact:
    """Contact between two layers of a stack.

    Parameters
    ----------
    resistance : float
        [m² K/W]; thermal paste about 1e-5, dry metal on metal 1e-4.
    """

    resistance: float


@dataclass
class _Piece:
    """What a joint or the Biot number needs to know of a lump."""

    capacity: float
    half: float | None = None  # from its center to an end face [K/W]; None: unknown, the lump was given as a number
    area: float | None = None  # of its end faces [m²]
    free_ends: int = 1  # faces a joint can use
    films: float = 0.0  # convection to ambients [W/K]
    across: float = 0.0  # Biot number of the section


class Assembly:
    """Builds a `System` from bodies with dimensions.

    Rods and layers are cut into lumps of equal length. Neighboring lumps are joined from center to center, the two
    halves in series, so that steady profiles and time constants converge with the square of the lump length.

    Examples
    --------
    >>> import robthermal as rt
    >>> a = rt.thermal.Assembly()
    >>> a.ambient("room", 298.15)
    >>> bar = a.rod("bar", length=0.1, area=1e-4, material="aluminium 6061", lumps=5, perimeter=0.04, convection=10.0,
    ...             ambient="room")
    >>> base = a.lump("base", capacity=50.0)
    >>> a.join(base, bar[0], contact_resistance=1e-4)
    >>> system = a.system(name="cooled bar", inputs={"Q": {"lump": base}}, sensors={"T": {"lump": bar[-1]}})
    >>> system.lump_names
    ('bar1', 'bar2', 'bar3', 'bar4', 'bar5', 'base')
    """

    def __init__(self) -> None:
        self._ambients: dict[str, float] = {}
        self._pieces: dict[str, _Piece] = {}
        self._links: list[Link] = []

    def ambient(self, name: str, temperature: float) -> None:
        """Add surroundings.

        Parameters
        ----------
        name : str
            For example "room".
        temperature : float
            Nominal temperature of the surroundings [K].
        """
        self._new(name)
        self._ambients[name] = kelvin(temperature, f"ambient {name!r} temperature")

    def lump(self, name: str, capacity: float) -> str:
        """Add a body of uniform temperature.

        Parameters
        ----------
        name : str
            Name of the lump.
        capacity : float
            Heat capacity of the body [J/K].

        Returns
        -------
        str
            The name.
        """
        self._new(name)
        self._pieces[name] = _Piece(positive_number(capacity, f"lump {name!r} capacity", "J/K"), free_ends=2**30)
        return name

    def rod(self, name: str, *, length: float, area: float, material: str | Material, lumps: int = 10,
            perimeter: float = 0.0, convection: float = 0.0, ambient: str | None = None) -> tuple[str, ...]:
        """Add a rod, cut along its length; its end faces are insulated until they are joined.

        Parameters
        ----------
        name : str
            The lumps are called name1, name2, …
        length : float
            Length of the rod, along the heat flow [m].
        area : float
            Of the section [m²].
        material : str or Material
            Of `materials`, or your own.
        lumps : int
            Number of lumps it is cut into [-].
        perimeter : float
            Of the section, where it loses heat [m].
        convection : float
            Film coefficient of the sides [W/(m² K)].
        ambient : str, optional
            Surroundings of the sides; needed with `convection`.

        Returns
        -------
        tuple of str
            Names of the lumps, in order.

        Raises
        ------
        InputError
            A dimension that is not positive, a name used twice, an ambient that does not exist.
        """
        where = f"rod {name!r}"
        n, stuff = whole_number(lumps, f"{where} lumps", 1), material_of(material, f"{where} material")
        dx = positive_number(length, f"{where} length", "m") / n
        section = positive_number(area, f"{where} area", "m²")
        edge, film = non_negative(perimeter, f"{where} perimeter", "m"), non_negative(convection, where, "W/(m² K)")
        if film and not edge:
            raise InputError("convection without a perimeter", where=where, remedy="Give perimeter [m].")
        if film:
            self._known_ambient(ambient, where)
        names = tuple(f"{name}{i + 1}" for i in range(n))
        for one in names:
            self._new(one)
        k = stuff.conductivity
        across = film * section / edge / k if edge else 0.0  # h (A/P)/k: volume over surface is the length
        for i, one in enumerate(names):
            ends = (i == 0) + (i == n - 1)
            self._pieces[one] = _Piece(stuff.volumetric_heat * section * dx, 0.5 * dx / (k * section), section, ends,
                                       film * edge * dx, across)
            if i:
                self._links.append(Link(between=(names[i - 1], one), conductance=k * section / dx))
            if film:
                self._links.append(Link(between=(one, str(ambient)), conductance=film * edge * dx))
        return names

    def stack(self, parts: Sequence[Layer | Contact], *, area: float) -> tuple[str, ...]:
        """Add layers on top of one another; the outer faces are insulated until they are joined.

        Parameters
        ----------
        parts : sequence of Layer or Contact
            From one face to the other; without a `Contact` two layers touch perfectly.
        area : float
            Cross-section of all layers [m²].

        Returns
        -------
        tuple of str
            Names of all lumps, in order.

        Examples
        --------
        >>> import robthermal as rt
        >>> a = rt.thermal.Assembly()
        >>> a.stack([rt.thermal.Layer("plate", 0.004, "copper"), rt.thermal.Contact(2e-5),
        ...          rt.thermal.Layer("pad", 0.010, "POM", lumps=3)], area=1.6e-3)
        ('plate1', 'pad1', 'pad2', 'pad3')
        """
        if not parts or isinstance(parts[0], Contact) or isinstance(parts[-1], Contact):
            raise InputError("begins or ends with a contact, or has no layer", where="argument parts",
                             remedy="Join its outer faces with Assembly.join(…, contact_resistance=…).")
        names: list[str] = []
        contact = 0.0
        for number, part in enumerate(parts, start=1):
            if isinstance(part, Contact):
                contact += non_negative(part.resistance, f"stack part {number} resistance", "m² K/W")
                continue
            if not isinstance(part, Layer):
                raise InputError(f"{part!r}", where=f"stack part {number}", expected="a Layer or a Contact",
                                 remedy="Build it with rt.thermal.Layer or rt.thermal.Contact.")
            new = self.rod(part.name, length=part.thickness, area=area, material=part.material, lumps=part.lumps)
            if names:
                self.join(names[-1], new[0], contact_resistance=contact)
                contact = 0.0
            names += new
        return tuple(names)

    def join(self, a: str, b: str, *, area: float | None = None, contact_resistance: float = 0.0,
             convection: float | None = None) -> None:
        """Join two bodies at an end face, or an end face to an ambient.

        The resistances lie in series: half of the end lump on each side, the contact, the film. To an ambient without
        film or contact the face is held at the temperature of the ambient.

        Parameters
        ----------
        a, b : str
            Lumps, or one lump and one ambient. Of a rod, only the end lumps have a face.
        area : float, optional
            Of the contact [m²]; default: the smaller end face.
        contact_resistance : float
            Thermal resistance of the joint times its area [m² K/W].
        convection : float, optional
            Film coefficient [W/(m² K)], for a face in a fluid.

        Raises
        ------
        InputError
            Unknown names, a face used twice, no area, or no resistance at all.
        """
        where = f"joint {a!r}-{b!r}"
        ends = [self._pieces[name] for name in (a, b) if self._end(name, where)]
        if not ends or a == b:
            raise InputError("joins no two bodies", where=where, expected="two lumps, or a lump and an ambient",
                             remedy="Correct the names.")
        per_area = non_negative(contact_resistance, f"{where} contact_resistance", "m² K/W")
        if convection is not None:
            per_area += 1 / positive_number(convection, f"{where} convection", "W/(m² K)")
        resistance = sum(end.half or 0.0 for end in ends)
        if per_area:
            resistance += per_area / self._contact_area(area, ends, where)
        if not resistance:
            raise InputError("has no resistance", where=where, remedy="Give contact_resistance, or make both one lump.")
        for end in ends:
            end.free_ends -= 1
        if convection is not None and len(ends) == 1:
            ends[0].films += 1 / (resistance - (ends[0].half or 0.0))
        self._links.append(Link(between=(a, b), conductance=1 / resistance))

    def biot(self) -> pd.DataFrame:
        """Biot number of every lump: internal over external resistance, Evers (5.6).

        Heat that convection takes from a lump must first cross the lump. "along": half the lump's length, Δx/(2 k A),
        times the conductance of all its films; more lumps lower it. "across": h (A/P)/k of the section; only a thinner
        section or a model in two dimensions lowers it. Conduction to neighbors does not count: its resistance is in
        the model.

        Returns
        -------
        DataFrame
            Index: lump. Columns: along [-], across [-], biot [-] (the larger). NaN for a lump given by its capacity.
        """
        rows = {name: (float("nan") if p.half is None else p.half * p.films,
                       float("nan") if p.half is None else p.across) for name, p in self._pieces.items()}
        table = pd.DataFrame.from_dict(rows, orient="index", columns=["along", "across"], dtype=float)
        table.index.name = "lump"
        return table.assign(biot=table.max(axis=1))

    def system(self, *, name: str = "assembly", links: Sequence[Link | dict[str, Any]] = (), **parts: Any) -> System:
        """System of everything added so far; warns where a Biot number is above 0.1.

        Parameters
        ----------
        name : str
            Name of the system, as reports show it.
        links : sequence of Link
            Further heat paths, beside those of the geometry.
        **parts
            inputs, modules, sensors, fit, temperature_unit of `System`.

        Returns
        -------
        System

        Raises
        ------
        InputError
            What `System` refuses.
        """
        self._warn()
        return System(name=name, ambients={k: {"temperature": T} for k, T in self._ambients.items()},
                      lumps={k: {"capacity": p.capacity} for k, p in self._pieces.items()},
                      links=[*self._links, *links], **parts)

    def _warn(self) -> None:
        table = self.biot()
        for column, remedy in (("along", "cut the body into more lumps"),
                               ("across", "the temperature varies across the section; model it in two dimensions")):
            high = table[column][table[column] > _BIOT].sort_values(ascending=False)
            if len(high):
                shown = ", ".join(f"{lump} ({value:.2g})" for lump, value in high.head(5).items())
                more = f" and {len(high) - 5} more" if len(high) > 5 else ""
                warnings.warn(f"Biot number {column} above {_BIOT}: {shown}{more}. Remedy: {remedy}.", UserWarning,
                              stacklevel=3)

    def _new(self, name: str) -> None:
        if not isinstance(name, str) or not name:
            raise InputError(f"{name!r} is no name", where="Assembly", expected="text", remedy="Name the body.")
        if name in self._pieces or name in self._ambients:
            raise InputError(f"the name {name!r} is used twice", where="Assembly", remedy="Rename one of them.")

    def _known_ambient(self, name: str | None, where: str) -> None:
        if name not in self._ambients:
            raise InputError(f"ambient {name!r} does not exist", where=where, expected="an ambient added before",
                             remedy="Add it with Assembly.ambient(name, temperature).")

    def _end(self, name: str, where: str) -> bool:
        """Whether `name` is a lump with a free face (an ambient is none)."""
        if name in self._ambients:
            return False
        if name not in self._pieces:
            raise InputError(f"{name!r} does not exist", where=where, expected="a lump or an ambient added before",
                             remedy="Lumps of a rod are called name1, name2, …")
        if not self._pieces[name].free_ends:
            raise InputError(f"{name!r} has no free end face", where=where, remedy="Join an end of the rod, or give a "
                             "conductance in links of Assembly.system.")
        return True

    def _contact_area(self, area: float | None, ends: Sequence[_Piece], where: str) -> float:
        if area is not None:
            return positive_number(area, f"{where} area", "m²")
        known = [end.area for end in ends if end.area is not None]
        if not known:
            raise InputError("the contact has no area", where=where, remedy="Give area [m²].")
        return min(known)
