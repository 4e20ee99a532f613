"""Drawing of a record."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from .._drawing import line_of, size_of

if TYPE_CHECKING:
    from ._record import Record

_QUANTITIES = {"K": "temperature", "degC": "temperature", "A": "current", "V": "voltage", "W": "heat", "%": "duty"}


def draw(record: Record) -> NDArray[Any]:
    """One axes per unit, inputs (held) above outputs."""
    # Imported here: matplotlib is slow to load, and most programs never draw.
    import matplotlib.pyplot as plt

    panels = _panels(record)
    figure, grid = plt.subplots(len(panels), 1, sharex=True, layout="constrained", squeeze=False,
                                figsize=size_of(max(4.8, 2.0 * len(panels))))
    axes: NDArray[Any] = grid[:, 0]
    for axis, (kind, unit, names) in zip(axes, panels, strict=True):
        own = record.input_names if kind == "inputs" else record.output_names
        for name in names:
            style: dict[str, Any] = {"where": "post"} if kind == "inputs" else {}
            paint = axis.step if kind == "inputs" else axis.plot
            place = own.index(name) if kind == "outputs" else -1 - own.index(name)  # inputs from the other end
            paint(record.time, record[name], label=name, **line_of(place), **style)
        axis.set_ylabel(f"{_QUANTITIES.get(unit, kind)} [{unit or 'no unit given'}]")
        axis.grid(True, alpha=0.3)
        axis.set_title(kind, loc="left", fontsize="small")
        if names:
            axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=min(len(names), 6), fontsize="small",
                        frameon=False, borderaxespad=0.2)  # above the curves, on none of them
    axes[-1].set_xlabel("time [s]")
    if record.name:
        figure.suptitle(record.name)
    return axes


def _panels(record: Record) -> list[tuple[str, str, list[str]]]:
    """Kind, unit and names of the channels that share an axis; both kinds have one, even without channels."""
    found: list[tuple[str, str, list[str]]] = []
    for kind, names in (("inputs", record.input_names), ("outputs", record.output_names)):
        units = dict.fromkeys(record.units.get(name, "") for name in names) or {"": None}
        found += [(kind, unit, [name for name in names if record.units.get(name, "") == unit]) for unit in units]
    return found
