"""Drawing of a record."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

if TYPE_CHECKING:
    from ._record import Record


def draw(record: Record) -> NDArray[Any]:
    """Two axes, inputs (held) above outputs."""
    # Imported here: matplotlib is slow to load, and most programs never draw.
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(2, 1, sharex=True, layout="constrained")
    for name in record.input_names:
        axes[0].step(record.time, record[name], where="post", label=_label(record, name))
    for name in record.output_names:
        axes[1].plot(record.time, record[name], label=_label(record, name))
    for axis, kind, names in zip(axes, ("inputs", "outputs"), (record.input_names, record.output_names), strict=True):
        axis.set_ylabel(kind)
        axis.grid(True, alpha=0.3)
        if names:
            axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=min(len(names), 6), fontsize="small",
                        frameon=False, borderaxespad=0.2)  # above the curves, on none of them
    axes[1].set_xlabel("time [s]")
    if record.name:
        figure.suptitle(record.name)
    grid: NDArray[Any] = axes
    return grid


def _label(record: Record, name: str) -> str:
    unit = record.units.get(name)
    return f"{name} [{unit}]" if unit else name
