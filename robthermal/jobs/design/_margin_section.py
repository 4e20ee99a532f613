"""What the report says of the loops: Bode and Nyquist plots with margins, nominal and over the parameter ranges."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..._pandas import pd
from ...report import Figure, Section, Table, house_style
from ...thermal import parameter_label
from ._design import ControllerDesign


def margin_section(result: ControllerDesign) -> Section:
    """Every loop with its margins, for the nominal and the worst plant."""
    found = result.margins
    ranges = f", {len(found.corners)} corner plants" if found.corners else ""
    figures = [figure for loop in found.loops for figure in (_bode(result, loop), _nyquist(result, loop))]
    wanted = ", ".join(f"{key} {value:g}" for key, value in (result.request.margins or {}).items())
    asked = f" Asked for: {wanted}." if wanted else ""
    several = (" All loops at once may each be multiplied by any complex (1 + e/2)/(1 - e/2) with |e| < "
               f"{found.disk:.3g} (disk margin, a lower bound)." if len(found.loops) > 1 else "")
    text = ("The loop as it is implemented, linearized at the set-points: currents held over a sample, sensors with "
            "lag and delay, the observer, the feedback law with the nominal parameters; opened at the heat the PI asks "
            f"for, the other loops closed{ranges}. {found.outcome.text}{asked}{several} Computed, not proven."
            + "".join(f"\n\n{said}" for said in result.missed))
    return Section("Margins of the loops", text, figures=tuple(figures),
                   tables=(Table(_finite(found.table()), "Margins."), *_worst(result)), anchor="margins")


def _finite(frame: pd.DataFrame) -> pd.DataFrame:
    """A margin that does not exist is said, not infinite."""
    columns = ["gain [-]", "phase [deg]", "delay [s]", "crossover [rad/s]"]
    return frame.assign(**{name: [f"{value:.3g}" if np.isfinite(value) else "none" for value in frame[name]]
                           for name in columns})


def _worst(result: ControllerDesign) -> tuple[Table, ...]:
    """Parameters of the plant with the smallest modulus margin of every loop."""
    if not result.margins.corners:
        return ()
    rows: list[dict[str, Any]] = [{"loop": loop, "parameter": name, "quantity": parameter_label(name),
                                   "value": value} for loop in result.margins.loops
                                  for name, value in result.margins.worst_plant(loop).corner.items()]
    return (Table(pd.DataFrame(rows), "Plant with the smallest modulus margin."),) if rows else ()


def _bode(result: ControllerDesign, loop: str) -> Figure:
    with house_style():
        axes = result.margins.plot_bode(loop)
        return Figure.draw(axes[0].figure, alt=f"Gain and phase of the loop of {loop} over frequency, with margins.",
                           caption=f"Loop of {loop}: nominal plant, with its margins{_behind(result)}.")


def _behind(result: ControllerDesign) -> str:
    return "; corner plants gray, behind it" if result.margins.corners else ""


def _nyquist(result: ControllerDesign, loop: str) -> Figure:
    with house_style():
        ax = result.margins.plot_nyquist(loop)
        return Figure.draw(ax.figure, alt=f"Loop of {loop} in the complex plane near -1.",
                           caption=f"Loop of {loop}: no curve enters the dashed circle around -1.")
