"""Optional keys of a system for effects beyond the plain network; zero or absent means that the effect is not there."""

from __future__ import annotations

from pydantic import model_validator

from ._part import Exponent, Finite, Kelvin, Name, NonNegative, Part, Positive, Share


class Drive(Part):
    """What a heater or an amplifier makes of the value u in its record column.

    v = (1 + gain) u + offset, then (1 + gain_slope abs(v)) v - cubic v³, then held within ±clip, then delayed, then
    lagged. Before the record the column had its first value, unless it is said otherwise.

    Parameters
    ----------
    gain : float
        Relative gain error [-].
    offset : float
        Value added to the scaled column [unit of the column].
    gain_slope : float
        Relative change of the gain with the modulus of the value [1/unit].
    cubic : float
        Coefficient of the cubic saturation [1/unit²].
    clip : float, optional
        Largest modulus of the value [unit of the column].
    delay : float
        Pure time delay of the drive [s].
    time_constant : float
        Time constant of the first-order lag [s].
    before : float, optional
        Value of the column before the record, for delay and lag [unit of the column]; default its first one.
    """

    gain: Finite = 0.0
    offset: Finite = 0.0
    gain_slope: Finite = 0.0
    cubic: Finite = 0.0
    clip: Positive | None = None
    delay: NonNegative = 0.0
    time_constant: NonNegative = 0.0
    before: Finite | None = None


class Hysteresis(Part):
    """Memory of a module's polarity: heat m into the cold face, time_constant dm/dt = sign(I) - m, from m = 0.

    I is the current before an amplifier's lag: behind one it never comes back to zero, and would keep its sign.

    Parameters
    ----------
    heat : float
        Amplitude of the heat into the cold face [W].
    time_constant : float
        Time constant of the memory's relaxation [s].
    """

    heat: Finite = 0.0
    time_constant: Positive


class Periodic(Part):
    """Periodic heat into a lump: heat sin(2π t / period + phase), t the record's time.

    Parameters
    ----------
    heat : float
        Amplitude of the heat [W].
    period : float
        Duration of one period [s].
    phase : float
        Phase of the sine at time zero [rad].
    """

    heat: Finite = 0.0
    period: Positive
    phase: Finite = 0.0


class Condensation(Part):
    """Heat released while a lump is below the dew point: conductance (dew_point - T).

    Parameters
    ----------
    conductance : float
        Heat released per kelvin below the dew point [W/K].
    dew_point : float
        Temperature below which water condenses [K].
    """

    conductance: NonNegative = 0.0
    dew_point: Kelvin


class Feedthrough(Part):
    """Share of a heater's heat that goes to another lump instead.

    Parameters
    ----------
    lump : str
        Name of the lump that receives the share.
    share : float
        Share of the heater's heat that goes there [-].
    """

    lump: Name
    share: Share = 0.0


class Step(Part):
    """Sudden change of a link: its linear conductance is multiplied by 1 + relative from `time` on.

    Parameters
    ----------
    relative : float
        [-], at least -1.
    time : float
        In the record's time [s].
    """

    relative: Finite = 0.0
    time: Finite


class Follow(Part):
    """A link that follows a column: its linear conductance is multiplied by 1 + relative times the column's modulus.

    Parameters
    ----------
    column : str
        Module or heater whose value, after its drive, is followed; a heater of gain 0 brings any recorded column.
    relative : float
        Growth of the conductance with the modulus of that value [1/unit].
    """

    column: Name
    relative: NonNegative = 0.0


class TemperatureLaw(Part):
    """A link that follows its own temperature T, the mean of both ends in kelvin.

    Its linear conductance is multiplied by (T / reference_temperature)^exponent.

    Parameters
    ----------
    exponent : float
        Power of the absolute temperature [-], from -10 to 10: about 0.8 for still air, 1 to 3 for fibres and foams
        that radiate within, below 0 for crystals.
    reference_temperature : float
        Temperature at which the link has its conductance [K].
    """

    exponent: Exponent = 0.0
    reference_temperature: Kelvin


class Lead(Part):
    """Lead or contact heating: resistance I² of a module's current, into a lump.

    Parameters
    ----------
    module : str
        Name of the module whose current flows through the lead.
    lump : str
        Where the heat goes.
    resistance : float
        Electrical resistance of lead or contact [Ω].
    name : str
        Name of the lead; default "module-lump".
    """

    module: Name
    lump: Name
    resistance: Finite = 0.0
    name: str = ""

    @model_validator(mode="after")
    def _named(self) -> Lead:
        if not self.name:
            object.__setattr__(self, "name", f"{self.module}-{self.lump}")
        return self


class Flow(Part):
    """Coolant that one lump has warmed reaches another one: heat conductance (T_upstream - T_ambient) into that.

    Parameters
    ----------
    upstream, downstream : str
        The lump that warms the coolant, and the one that it reaches.
    ambient : str
        The coolant as it enters.
    conductance : float
        Heat carried per kelvin that the upstream lump is warmer than the entering coolant [W/K].
    name : str
        Name of the flow; default "upstream-downstream".
    """

    upstream: Name
    downstream: Name
    ambient: Name
    conductance: NonNegative = 0.0
    name: str = ""

    @model_validator(mode="after")
    def _named(self) -> Flow:
        if self.upstream == self.downstream:
            raise ValueError(f"both lumps are {self.upstream!r}: a flow leads from one lump to another")
        if not self.name:
            object.__setattr__(self, "name", f"{self.upstream}-{self.downstream}")
        return self
