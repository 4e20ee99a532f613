"""Current limits over the operating conditions of a machine: values from the command line, files, report."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..._celsius import ZERO_CELSIUS
from ..._joblib import joblib
from ..._pandas import pd
from ...certify import LimitMap, UsableCurrent, limit_map, runaway
from ...errors import InputError
from ...report import Figure, Reason, Report, Section, Table, house_style
from ...thermal import System
from ...verification import Certificate, verify
from ..claims import Checked, GateCode, machine_assumptions, required_claims
from ..evidence import write_certification
from ..folder import output_folder
from ..now import now
from ..provenance import provenance, simulated_label, subtitle
from ..request import Method, boxes_from_text, in_kelvin

_MOST = 2000  # conditions: hours beyond
_LOADS = 6


@dataclass(frozen=True)
class MapRequest:
    """Conditions of a map.

    Parameters
    ----------
    ambient, setpoint : tuple of float
        Of all ambients and all cold faces [K].
    load : tuple of float
        Heat into every cold face [W], the only heat that is counted: the heaters are off; empty for six values up to
        the runaway load of the middle set-point.
    temperature : tuple of float
        Box of the certificate [K].
    method : str
        Norm of the contraction.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.jobs.MapRequest(ambient=(298.15,), setpoint=(278.15, 283.15), load=(0.0, 2.0)).conditions
    4
    """

    ambient: tuple[float, ...]
    setpoint: tuple[float, ...]
    load: tuple[float, ...] = ()
    temperature: tuple[float, float] = (278.15, 358.15)
    method: Method = "energy"

    @property
    def conditions(self) -> int:
        """How many there are."""
        return len(self.ambient) * len(self.setpoint) * (len(self.load) or _LOADS)


def map_from_text(system: System, *, ambient: str | None = None, load: str | None = None, setpoint: str | None = None,
                  temperature: tuple[float, float] | None = None, method: str = "energy") -> MapRequest:
    """Request from command-line values.

    Parameters
    ----------
    system : System
        Whose temperature unit and nominal ambient apply.
    ambient, setpoint : str, optional
        ``LO,HI,N`` or one value [unit of the file]; default 10 K around nominal, 5 values; from the lower end of the
        box to nominal, 3 values.
    load : str, optional
        ``LO,HI,N`` or one value [W]; default six values up to the runaway load.
    temperature : tuple of float, optional
        Box of the certificate [unit of the file].
    method : str
        "energy", "sum", "max" or "lyapunov".

    Returns
    -------
    MapRequest

    Raises
    ------
    InputError
        A value that does not read, too many conditions, a system without modules, a cascade.

    Examples
    --------
    >>> import robthermal as rt
    >>> rt.jobs.map.map_from_text(rt.systems.two_module(), ambient="15,35,3", load="0,4,2", setpoint="5").ambient
    (288.15, 298.15, 308.15)
    """
    if not system.modules:
        raise InputError(f"{system.name!r} has no thermoelectric module", where="map",
                         remedy="Without modules there is no current to limit: use certify.")
    if system.cascade:
        raise InputError(f"a cascade: {system.cascade}", where="map",
                         expected="modules side by side: a map has one set-point and one load for all cold faces",
                         remedy="Use certify with a --setpoint for every stage: contraction, boxes and limits of a "
                         "cascade are certified.")
    boxes = boxes_from_text(system, temperature=temperature, method=method)
    unit, nominal = system.temperature_unit, next(iter(system.ambients.values())).temperature
    ends = sorted((boxes.temperature[0], nominal))
    request = MapRequest(
        _kelvin(ambient, unit, "--ambient") or _steps(nominal - 10.0, nominal + 10.0, 5),
        _kelvin(setpoint, unit, "--setpoint") or _steps(ends[0], ends[1], 3), _axis(load, "--load"), boxes.temperature,
        boxes.method)
    if request.conditions > _MOST:
        raise InputError(f"{request.conditions} conditions", where="--ambient, --load, --setpoint",
                         expected=f"at most {_MOST}", remedy="Ask for fewer values.")
    return request


def map_system(system: System, request: MapRequest,
               progress: Callable[[int, int], None] = lambda done, total: None) -> LimitMap:
    """Map the usable current of a system.

    Parameters
    ----------
    system : System
        System with at least one module.
    request : MapRequest
        Conditions that the map covers.
    progress : callable, optional
        Called with how many ambients and set-points are done, and how many there are.

    Returns
    -------
    LimitMap

    Examples
    --------
    >>> import robthermal as rt
    >>> wanted = rt.jobs.MapRequest(ambient=(298.15,), setpoint=(283.15,), load=(1.0,))
    >>> rt.jobs.map_system(rt.systems.two_module(), wanted).data["allowed"].tolist()
    [True]
    """
    loads = request.load
    if not loads:
        target = request.setpoint[len(request.setpoint) // 2]
        most = min(runaway(system, setpoint=dict.fromkeys(system.modules, target)).load.values())
        loads = _steps(0.0, max(most, 0.0), _LOADS)
    points = len(request.ambient) * len(request.setpoint)
    jobs = min(joblib.cpu_count(), max(points // 3, 1))  # a process costs as much to start as a point or two
    return limit_map(system, ambient=request.ambient, setpoint=request.setpoint, load=loads,
                     temperature=request.temperature, method=request.method, jobs=jobs, progress=progress)


def write_map(result: LimitMap, system: System, files: tuple[Path, ...], out: str | Path) -> Report:
    """Write a map into a folder, which appears only when complete.

    Parameters
    ----------
    result : LimitMap
        Map, as `map_system` returns it.
    system : System
        Of the map.
    files : tuple of Path
        Input files, for their hashes.
    out : str or Path
        Output folder: map.csv, report.html, junit.xml, summary.json, certificates/map_*.json.

    Returns
    -------
    Report

    Raises
    ------
    InputError
        If the folder cannot be written, or holds something else.

    Examples
    --------
    >>> import robthermal as rt
    >>> system = rt.systems.two_module()
    >>> wanted = rt.jobs.MapRequest(ambient=(298.15,), setpoint=(283.15,), load=(1.0,))
    >>> found = rt.jobs.map_system(system, wanted)
    >>> rt.jobs.write_map(found, system, (), "map").holds
    True
    """
    checked = tuple(
        _checked(f"map_{number}_{key}", f"{title}, {condition}", certificate)
        for box, condition, number in _conditions(result, system)
        for key, title, certificate in (("never_left", f"Box with {box.current:.4g} A is never left", box.invariance),
                                        ("contraction", f"Contraction with {box.current:.4g} A", box.contraction)))
    data = in_unit(result.data, system.temperature_unit)
    report = Report(title=f"Current limits of {system.name}", subtitle=subtitle(system, system.name),
                    label=simulated_label([system.name, *(file.name for file in files)]),
                    claims=required_claims(checked), sections=(), first=(_section(result, data),),
                    provenance=provenance(files), assumptions=(*machine_assumptions(system), *_ASSUMPTIONS),
                    generated=now(), gate=_remarks(system), gates=(GateCode.HEATERS_OFF.code,))
    with output_folder(out) as folder:
        report = write_certification(checked, report, folder)
        data.to_csv(folder / "map.csv", index=False)
    return report


def _conditions(result: LimitMap, system: System) -> list[tuple[UsableCurrent, str, int]]:
    """Usable currents of the map with their condition in words and a number; one at least."""
    found = [(box, f"{_condition(ambient, load, system.temperature_unit)}, {direction} currents", number)
             for number, ((ambient, load, direction), box) in enumerate(result.boxes.items(), 1)]
    return [entry for entry in found if entry[0].holds] or found[:1]


def _remarks(system: System) -> tuple[Reason, ...]:
    """That the heaters of the file are off, if it has any that can be on."""
    heaters = [f"{name} (into {heater.lump})" for name, heater in system.inputs.items()
               if heater.gain]
    if not heaters:
        return ()
    return (Reason("remark", GateCode.HEATERS_OFF.code, "map", "heaters", "The load on the cold faces is all heat that "
                   f"is counted; off in every row: {', '.join(heaters)}.", GateCode.HEATERS_OFF.remedy),)


def _condition(ambient: float, load: float, unit: str) -> str:
    value, name = (ambient, "K") if unit == "K" else (ambient - ZERO_CELSIUS, "°C")
    return f"ambient {value:.4g} {name}, load {load:.4g} W"


def _checked(key: str, title: str, certificate: Certificate) -> Checked:
    return Checked(key, title, certificate, verify(certificate) if certificate.holds else None, True)


_ASSUMPTIONS = (
    "All modules hold their cold faces at one set-point, all ambients have one temperature, every cold face has the "
    "same load. Heaters of the system file are off.",
    "I* and the needed current are computed, not proven. The boxes of the usable currents are proven: never left, and "
    "contracting in them.",
)


def in_unit(data: pd.DataFrame, unit: str) -> pd.DataFrame:
    """Map with its temperatures in the unit of the system file, and said in the column names."""
    if unit == "K":
        return data
    out = data.assign(**{name: data[name] - ZERO_CELSIUS for name in ("ambient [K]", "setpoint [K]")}).round(9)
    return out.rename(columns={"ambient [K]": "ambient [degC]", "setpoint [K]": "setpoint [degC]"})


def _section(result: LimitMap, data: pd.DataFrame) -> Section:
    with house_style():
        axes = result.plot()
        figure = Figure.draw(axes[0].figure, alt="Current needed and usable over the load, a panel per set-point, a "
                             "color per ambient temperature.",
                             caption="Needed (line) and usable (dashed) current. A line ends where no stable "
                             "equilibrium holds more load.")
    text = (f"{result.outcome.text} The usable current is the smallest of 0.98 I*, I* the runaway limit of the "
            "regulated machine, the current up to which a box inside the stated one is never left, the contraction "
            "limit inside the stated box (which is not a limit for use), and the rating. Conditions without a needed "
            "current cannot be held. All rows are in map.csv.")
    words = {name: name.replace("degC", "°C").replace("setpoint", "set-point") for name in data.columns}
    return Section("Map of current limits", text, figures=(figure,),
                   tables=(Table(data.rename(columns=words), "Conditions."),), anchor="map")


def _axis(text: str | None, option: str) -> tuple[float, ...]:
    """Numbers of ``LO,HI,N`` or of one value; empty for None."""
    if text is None:
        return ()
    words = text.split(",")
    try:
        if len(words) == 1:
            return _steps(float(words[0]), float(words[0]), 1)
        low, high, count = float(words[0]), float(words[1]), int(words[2])
        if len(words) == 3 and low < high and count >= 2:
            return _steps(low, high, count)
    except (ValueError, IndexError, OverflowError):
        pass
    raise InputError(f"{text!r}", where=option, expected="LO,HI,N with LO < HI and N at least 2, or one value",
                     remedy="For example 15,35,5.")


def _kelvin(text: str | None, unit: str, option: str) -> tuple[float, ...]:
    return tuple(in_kelvin(value, unit, option) for value in _axis(text, option))


def _steps(low: float, high: float, count: int) -> tuple[float, ...]:
    if not np.isfinite([low, high]).all():
        raise ValueError("not finite")
    return tuple(np.linspace(low, high, count).tolist())
