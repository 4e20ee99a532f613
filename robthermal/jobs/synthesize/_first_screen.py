"""First screen of a synthesis: the number that is claimed, the least margin, and one picture."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...design import Design, FeedbackDesign, FrfDesign, LpvDesign, MpcDesign, TemFeedback
from ...report import Figure, Section, house_style
from ..claims import loop_margin, loop_title

_TELLING = 1e-3  # of the value: an estimate of the best that is smaller says nothing


def numbers_of(design: Design) -> Iterator[tuple[str, str, str]]:
    """What is claimed of the loop, and the phase margin of the loop that has least.

    Parameters
    ----------
    design : Design
        What was found; nothing is said of one that does not hold.
    """
    if not design.holds:
        return
    telling = np.isfinite(design.lower) and design.lower > _TELLING * design.value
    best = f"best possible: about {design.lower:.4g}, estimated" if telling else ""
    for number, one in enumerate(design.certificates):
        if "bound" in one.region or "bounds" in one.region or one.region.get("rate"):
            yield f"{loop_title(one)}, as claimed below", loop_margin(one), best if number == 0 else ""
    if not design.certificates:
        yield "largest sensitivity at the bins", f"{design.value:.4g}", "computed, not proven"
    loops = {name: one for name, one in design.margins.items() if name != "all loops at once"}
    if loops:
        least = min(loops, key=lambda name: loops[name]["phase"])
        yield "least phase margin", f"{loops[least]['phase']:.3g}°", f"loop of {least}; computed, not proven"


def first_screen(design: Design) -> tuple[Section, ...]:
    """The picture that belongs on the first screen; none of a design that does not hold.

    Parameters
    ----------
    design : Design
        What was found.
    """
    if not design.holds:
        return ()
    title, alt, caption = _words(design)
    with house_style():
        ax = design.plot()
        figure = Figure.draw(ax.figure, alt=alt, caption=caption)
    return (Section(title, "", figures=(figure,), anchor="picture"),)


def _words(design: Design) -> tuple[str, str, str]:
    if isinstance(design, TemFeedback):
        return ("Where the machine may start", "Box of every lump, operating temperature, and reach of the ellipsoid.",
                "Temperature of every lump at the operating point, how far the ellipsoid of starts reaches, and the "
                "box it stays in.")
    if isinstance(design, MpcDesign):
        return ("The terminal set", "Shadow of an ellipsoid on the plane of the first two states.",
                "Shadow of the terminal set on the first two states: the end of every prediction lies in it.")
    if isinstance(design, FeedbackDesign):
        return ("Eigenvalues of the loop", "Eigenvalues of the loops at the vertices in the complex plane.",
                "Eigenvalues of the loops at the vertices, computed.")
    if isinstance(design, FrfDesign):
        return ("Sensitivity of the loop", "Size of the sensitivity over frequency, with what was asked for.",
                "Size of the sensitivity 1/(1 + GC), of matrices its largest singular value, computed from the "
                "response; dotted, where there are confidence circles, the worst plant in them.")
    what = "loops at the vertices" if isinstance(design, LpvDesign) else "closed loop"
    return ("Gain of the loop over frequency", f"Largest singular value of the {what} over frequency.",
            f"Largest singular value of the {what} from disturbances to performance outputs, computed.")
