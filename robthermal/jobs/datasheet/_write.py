"""[modules.NAME] tables of a system file, ready to paste."""

from __future__ import annotations

import json
import re
from pathlib import Path

from ..._celsius import ZERO_CELSIUS
from ..._write import write
from ...thermal import Linear
from ._compare import ModuleComparison

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def write_modules(found: ModuleComparison, path: str | Path) -> None:
    """Write the modules of a comparison as tables of a system file with temperature_unit = "degC".

    Parameters
    ----------
    found : ModuleComparison
        Modules with their inversions; those of its basis are written.
    path : str or Path
        File to write, TOML.

    Examples
    --------
    >>> import robthermal as rt
    >>> sheets = rt.jobs.datasheet.read_sheets(["TM 127-1.4-4.0"])
    >>> rt.jobs.datasheet.write_modules(rt.jobs.datasheet.compare_modules(sheets), "module.toml")
    """
    write(path, "\n".join(_lines(found)).encode("utf-8"))


def _lines(found: ModuleComparison) -> list[str]:
    lines = ["# Set hot and cold to lumps of your system file; temperatures in degrees Celsius, for a file with",
             '# temperature_unit = "degC". No current_limits are written: Imax is no limit of damage, and a module on',
             "# a real heat sink runs away thermally at a smaller current.", ""]
    for one in found.modules:
        chosen = one.sheet.by(found.basis)
        p = chosen.properties
        said = ", ".join(f"{rating.t_hot - ZERO_CELSIUS:.4g} °C" for rating in one.sheet.ratings)
        lines += [f"# from {'Vmax' if found.basis == 'voltage' else 'Qmax'}, Imax, dTmax at {said}; largest misfit of "
                  f"any rated value {100 * chosen.largest_misfit:.1f} %",
                  f"[modules.{one.name if _BARE.fullmatch(one.name) else json.dumps(one.name, ensure_ascii=False)}]",
                  'hot = "hot"', 'cold = "cold"', f"seebeck = {_value(p.seebeck)}  # V/K",
                  f"resistance = {_value(p.resistance)}  # Ω", f"conductance = {_value(p.conductance)}  # W/K",
                  f"reference_temperature = {p.reference_temperature - ZERO_CELSIUS:.10g}", ""]
    return lines


def _value(p: Linear) -> str:
    return f"{{ value = {p.value!r}, slope = {p.slope!r} }}" if p.slope else f"{{ value = {p.value!r} }}"
