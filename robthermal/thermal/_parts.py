"""The parts of a thermal system: ambients, lumps, links, heaters, thermoelectric modules, measured outputs."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, field_validator, model_validator

from ._effect_parts import Condensation as Condensation
from ._effect_parts import Drive as Drive
from ._effect_parts import Feedthrough as Feedthrough
from ._effect_parts import Flow as Flow
from ._effect_parts import Follow as Follow
from ._effect_parts import Hysteresis as Hysteresis
from ._effect_parts import Lead as Lead
from ._effect_parts import Periodic as Periodic
from ._effect_parts import Step as Step
from ._effect_parts import TemperatureLaw as TemperatureLaw
from ._part import Finite, Kelvin, NonNegative, Positive, Range, ordered
from ._part import Name as Name
from ._part import Part as Part
from ._supply import Supply as Supply

_DIFFERENCE = 10.0  # K, at which a conductance and natural convection take the same heat


class Ambient(Part):
    """Surroundings at a prescribed temperature.

    Parameters
    ----------
    temperature : float
        Used when a record has no column of this name [K].
    coolant : tuple of str
        Lumps that it passes, in this order; a diagnosis asks whether it gets warm on the way.
    """

    temperature: Kelvin
    coolant: tuple[Name, ...] = ()


class Lump(Part):
    """A mass of uniform temperature.

    Parameters
    ----------
    capacity : float
        Heat capacity of the lump [J/K].
    disturbance : float
        Unmeasured random heat [W/√Hz].
    initial : float, optional
        Temperature at the start [K]; default: the nearest measured value, else the first ambient.
    heat : float
        Constant heat source [W].
    gradient : float
        What its links to ambients see is the ambient plus this [K].
    periodic : Periodic, optional
        Periodic heat into the lump.
    condensation : Condensation, optional
        Heat below the dew point.
    """

    capacity: Positive
    disturbance: NonNegative = 0.0
    initial: Kelvin | None = None
    heat: Finite = 0.0
    gradient: Finite = 0.0
    periodic: Periodic | None = None
    condensation: Condensation | None = None


class Natural(Part):
    """Natural convection: heat = gain ``|dT|^exponent dT`` [W].

    Parameters
    ----------
    gain : float
        Heat at a difference of one kelvin, G_n [W/K^(1+exponent)].
    exponent : float
        [-]; 0.25 for laminar flow.
    """

    gain: NonNegative
    exponent: NonNegative = 0.25

    @classmethod
    def as_much_as(cls, conductance: float, exponent: float = 0.25) -> Natural:
        """Natural convection that takes as much heat as a conductance at a difference of 10 K.

        Parameters
        ----------
        conductance : float
            Thermal conductance at that difference [W/K].
        exponent : float
            Power of the difference [-].

        Returns
        -------
        Natural

        Examples
        --------
        >>> import robthermal as rt
        >>> round(rt.thermal.Natural.as_much_as(0.5).gain * 10.0**0.25, 12)
        0.5
        """
        return cls(gain=conductance / _DIFFERENCE**exponent, exponent=exponent)


class Link(Part):
    """A heat path between two lumps, or a lump and an ambient.

    Parameters
    ----------
    between : tuple of str
        The two ends.
    conductance : float
        Thermal conductance of the linear part [W/K].
    natural : Natural, optional
        Natural convection added to it.
    radiation : float, optional
        Coefficient of Ta⁴ - Tb⁴ [W/K⁴].
    step : Step, optional
        Sudden change of the linear part.
    follow : Follow, optional
        Dependence of the linear part on a current, or on a recorded force or fan speed.
    temperature_law : TemperatureLaw, optional
        Dependence of the linear part on the temperature of the link; of several such changes, each adds to the others.
    name : str
        Name of the link; default "a-b".
    """

    between: tuple[Name, Name]
    conductance: NonNegative = 0.0
    natural: Natural | None = None
    radiation: NonNegative | None = None
    step: Step | None = None
    follow: Follow | None = None
    temperature_law: TemperatureLaw | None = None
    name: str = ""

    @model_validator(mode="after")
    def _named_and_real(self) -> Link:
        if self.between[0] == self.between[1]:
            raise ValueError(f"both ends are {self.between[0]!r}: a link must join two different nodes")
        if not {"conductance", "natural", "radiation"} & self.model_fields_set:
            raise ValueError("carries no heat: give conductance, natural or radiation")
        if not self.name:
            object.__setattr__(self, "name", "-".join(self.between))
        return self


class Input(Part):
    """A heater.

    Parameters
    ----------
    lump : str
        Where its heat goes.
    gain : float
        Heat per unit of the record column [W/unit].
    limits : tuple of float, optional
        Range of the record column [unit].
    unit : str, optional
        Unit of the record column, for example "%"; default W where gain is 1.
    drive : Drive
        What the heater makes of its column; default: exactly that.
    power_slope : float, optional
        The heat is multiplied by 1 + power_slope (T_lump - T_ref) [1/K], T_ref the first ambient's nominal temperature.
    feedthrough : Feedthrough, optional
        Part of the heat that goes to another lump.
    """

    lump: Name
    gain: Finite = 1.0
    limits: Range | None = None
    unit: str | None = None
    drive: Drive = Drive()
    power_slope: Finite | None = None
    feedthrough: Feedthrough | None = None

    _check = field_validator("limits")(ordered)


class Linear(Part):
    """A property that varies linearly with temperature: value + slope (T - reference_temperature).

    Parameters
    ----------
    value : float
        At the reference temperature.
    slope : float
        Change of the property per kelvin [unit of the property/K].
    """

    value: Positive
    slope: Finite = 0.0


class Module(Part):
    """A thermoelectric module; positive current pumps heat from `cold` to `hot`.

    Parameters
    ----------
    hot, cold : str
        Lumps of its two faces.
    seebeck : Linear
        Seebeck coefficient S(T_avg) [V/K], slope [V/K²].
    resistance : Linear
        Electrical resistance R(T_avg) [Ω], slope [Ω/K].
    conductance : Linear
        Thermal conductance K(T_avg) [W/K], slope [W/K²].
    reference_temperature : float
        Mean temperature at which the three properties have their values [K].
    current_limits : tuple of float, optional
        Lowest and highest allowed current [A].
    thomson : float
        Thomson coefficient: ½ thomson I (T_hot - T_cold) is taken from both faces [V/K].
    joule_split : float
        Unequal Joule heat: joule_split R I² more at the cold face, less at the hot one [-].
    hysteresis : Hysteresis, optional
        Memory of the polarity.
    drive : Drive
        What the amplifier makes of its column; default: exactly that.
    supply : Supply, optional
        Supply and bridge: what current they can drive. The equations do not know them.
    """

    hot: Name
    cold: Name
    seebeck: Linear
    resistance: Linear
    conductance: Linear
    reference_temperature: Kelvin = 298.15
    current_limits: Range | None = None
    thomson: Finite = 0.0
    joule_split: Finite = 0.0
    hysteresis: Hysteresis | None = None
    drive: Drive = Drive()
    supply: Supply | None = None

    _check = field_validator("current_limits")(ordered)

    @field_validator("seebeck", "resistance", "conductance", mode="before")
    @classmethod
    def _number_is_a_value(cls, value: Any) -> Any:
        return {"value": value} if isinstance(value, int | float) and not isinstance(value, bool) else value

    @model_validator(mode="after")
    def _consistent(self) -> Module:
        if self.hot == self.cold:
            raise ValueError(f"hot and cold are both {self.hot!r}: a module must join two different lumps")
        sloped = any(p.slope for p in (self.seebeck, self.resistance, self.conductance))
        if sloped and "reference_temperature" not in self.model_fields_set:
            raise ValueError("has a slope but no reference_temperature: say at which temperature the values hold")
        return self


class Sensor(Part):
    """A measured output: the temperature of a lump, or the voltage of a thermoelectric module.

    A temperature reads T_ref + gain (T_lagged - T_ref) + offset, T_ref the first ambient's nominal temperature. A
    voltage reads gain V + offset with V = (S - thomson) (T_hot - T_cold) + (R + lead_resistance) I, positive where
    positive current enters: without current S (T_hot - T_cold), and V I (without leads) is the heat that the two faces
    reject together.

    Parameters
    ----------
    lump : str
        Whose temperature it measures; empty for a voltage.
    module : str
        Module whose voltage it measures; empty for a temperature.
    quantity : {"temperature", "voltage"}
        What it measures; a sensor of a module measures its voltage.
    noise : float
        Standard deviation of the reading [K or V]; 0 means not declared.
    time_constant : float
        Time constant of the first-order lag of a thermometer [s].
    offset : float
        Constant error added to the reading [K or V].
    gain : float
        Factor on the distance from T_ref, or on the voltage [-].
    delay : float
        Pure time delay of a thermometer [s].
    self_heating : float
        Heat of a thermometer into its lump [W].
    lead_resistance : float, optional
        Resistance of the wires between the module and the terminals where the voltage is read [Ω]; it heats no lump.
    read : {"after", "before"}
        Whether a program reads a voltage after it sets the current of a row of a record, or before: then the voltage of
        a row is that at the current of the row before. A matter of records alone.
    initial : float, optional
        Temperature of a lagged thermometer at the start [K]; default that of its lump: settled.
    """

    lump: str = Field(default="", max_length=200)
    module: str = Field(default="", max_length=200)
    quantity: Literal["temperature", "voltage"] = "temperature"
    noise: NonNegative = 0.0
    time_constant: NonNegative = 0.0
    offset: Finite = 0.0
    gain: Positive = 1.0
    delay: NonNegative = 0.0
    self_heating: Finite = 0.0
    lead_resistance: NonNegative | None = None
    read: Literal["after", "before"] = "after"
    initial: Kelvin | None = None

    @property
    def lag(self) -> str:
        """How late a thermometer reads, in words; empty where it reads its lump at once."""
        parts = (f"time constant {self.time_constant:g} s" * bool(self.time_constant),
                 f"delay {self.delay:g} s" * bool(self.delay))
        return ", ".join(filter(None, parts))

    @property
    def unit(self) -> str:
        """Unit of the reading: "K" or "V"."""
        return "V" if self.quantity == "voltage" else "K"

    @model_validator(mode="after")
    def _one_quantity(self) -> Sensor:
        if bool(self.lump) == bool(self.module):
            raise ValueError("key 'lump' is missing: name the lump whose temperature is read, or the module whose "
                             "voltage is" if not self.lump else "names a lump and a module: it measures one of them")
        voltage = bool(self.module)
        if "quantity" in self.model_fields_set and voltage != (self.quantity == "voltage"):
            raise ValueError(f'quantity = "{self.quantity}" of a {"module" if voltage else "lump"}: a lump has a '
                             "temperature, a module a voltage")
        if voltage:
            object.__setattr__(self, "quantity", "voltage")
        of_others = ("time_constant", "delay", "self_heating", "initial") if voltage else ("lead_resistance", "read")
        wrong = [key for key in of_others if getattr(self, key) and (key != "read" or self.read == "before")]
        if wrong:
            raise ValueError(f"{wrong[0]} does not belong to a {self.quantity}: "
                             + ("a voltage is read at once and heats nothing" if voltage else
                                "it is that of the voltage of a module"))
        return self


class FitRange(Part):
    """What calibration may do to one parameter.

    Parameters
    ----------
    lower, upper : float
        Bounds, in the unit of the parameter.
    sigma : float, optional
        Standard deviation of the prior around the value in the file.
    """

    lower: Finite
    upper: Finite
    sigma: Positive | None = None

    @model_validator(mode="after")
    def _ordered(self) -> FitRange:
        if not self.lower < self.upper:
            raise ValueError(f"lower {self.lower} is not below upper {self.upper}")
        return self
