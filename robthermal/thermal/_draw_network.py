"""Drawing of a system: lumps and ambients as boxes, links and modules as lines, sensors and heaters where they sit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arrays import Array
from .._drawing import COLORS, axes_for
from ..errors import InputError
from ._layout_network import positions

if TYPE_CHECKING:
    from ._system import System

_LETTER, _LINE, _EDGE = 0.085, 0.18, 0.1  # width of a letter, height of a line, margin of a box [inch]
_LARGEST = 300  # nodes; more are a grey cloud


@dataclass(frozen=True)
class _Node:
    """A box: its name and what stands below it."""

    name: str
    ambient: bool
    lines: tuple[tuple[str, str, str], ...]  # text, marker before it, color of the marker

    @property
    def size(self) -> tuple[float, float]:
        longest = max(len(text) + 2 * bool(marker) for text, marker, _ in self.lines)
        return longest * _LETTER + 2 * _EDGE, len(self.lines) * _LINE + 2 * _EDGE


def draw_network(system: System, ax: Any = None) -> Any:
    """Axes with the network of a system.

    Parameters
    ----------
    system : System
        What to draw.
    ax : matplotlib axes, optional
        Axes to draw into; default new ones.
    """
    nodes = _nodes(system)
    if len(nodes) > _LARGEST:
        raise InputError(f"{len(nodes)} lumps and ambients", where="System.plot", expected=f"at most {_LARGEST}",
                         remedy="Draw a smaller model, for example one of rt.thermal.reduce.")
    index = {node.name: k for k, node in enumerate(nodes)}
    sizes = np.array([node.size for node in nodes])
    ends = [link.between for link in system.links] + [(m.cold, m.hot) for m in system.modules.values()]
    places = positions(sizes, [(index[a], index[b]) for a, b in ends])
    low, high = (places - sizes / 2).min(axis=0) - 0.1, (places + sizes / 2).max(axis=0) + 0.1
    width, height = np.maximum(high - low, (4.2, 1.0))
    ax = axes_for(ax, figsize=(width, height + 0.7))
    for link in system.links:
        a, b = places[index[link.between[0]]], places[index[link.between[1]]]
        ax.plot(*np.transpose([a, b]), color="#888888", linewidth=1.2, zorder=1)
    for name, module in system.modules.items():
        cold, hot = index[module.cold], index[module.hot]
        _module(ax, name, places[cold], places[hot], sizes[hot])
    for flow in system.flows:
        start, end = index[flow.upstream], index[flow.downstream]
        _arrow(ax, places[start], places[end], sizes[end], linewidth=1.4, color="C0", linestyle="--")
    for node, place, size in zip(nodes, places, sizes, strict=True):
        _box(ax, node, place, size)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    ax.set_axis_off()
    _legend(ax, system)
    return ax


def _nodes(system: System) -> list[_Node]:
    below: dict[str, list[tuple[str, str, str]]] = {name: [] for name in (*system.lumps, *system.ambients)}
    for k, (name, sensor) in enumerate(system.sensors.items()):
        if sensor.lump:
            below[sensor.lump].append((name, "o", COLORS[k % len(COLORS)]))
    for name, heater in system.inputs.items():
        below[heater.lump].append((name, "^" if heater.gain else "D", "black"))
    return [_Node(name, name in system.ambients, ((name, "", ""), *below[name])) for name in below]


def _box(ax: Any, node: _Node, place: Array, size: Array) -> None:
    # Imported here: matplotlib is slow to load, and most programs draw nothing.
    from matplotlib.patches import FancyBboxPatch

    (x, y), (width, height) = place - size / 2 + 0.05, size - 0.1
    ax.add_patch(FancyBboxPatch((x, y), width, height, boxstyle="round,pad=0.05", facecolor="white", linewidth=1.1,
                                zorder=3, linestyle=(0, (4, 2)) if node.ambient else "-",
                                edgecolor="#666666" if node.ambient else "black"))
    top = place[1] + (len(node.lines) - 1) * _LINE / 2
    for k, (text, marker, color) in enumerate(node.lines):
        y, shift = top - k * _LINE, _LETTER if marker else 0.0
        ax.text(place[0] + shift, y, text.replace("$", r"\$"), ha="center", va="center", fontsize=8, zorder=4,
                fontweight="bold" if k == 0 and not node.ambient else "normal")
        if marker:
            ax.plot(place[0] + shift - (len(text) + 1.6) * _LETTER / 2, y, marker, color=color, markersize=6, zorder=4)


def _module(ax: Any, name: str, cold: Array, hot: Array, size: Array) -> None:
    """A thick line from the cold to the hot face, ending in an arrow at the edge of the hot lump's box."""
    _arrow(ax, cold, hot, size, linewidth=2.6, color="black")
    ax.text(*(cold + hot) / 2, name.replace("$", r"\$"), ha="center", va="center", fontsize=8, fontstyle="italic",
            zorder=5, bbox={"facecolor": "white", "edgecolor": "black", "linewidth": 0.8, "pad": 1.6})


def _arrow(ax: Any, start: Array, end: Array, size: Array, **style: Any) -> None:
    """An arrow that ends at the edge of a box of this size."""
    along = start - end
    share = float(np.min(np.divide(size / 2 + 0.03, np.abs(along), out=np.full(2, np.inf), where=along != 0)))
    ax.annotate("", end + min(share, 0.9) * along, start, zorder=2, annotation_clip=False,
                arrowprops={"arrowstyle": "-|>", "shrinkA": 0, "shrinkB": 0, "mutation_scale": 13, **style})


def _legend(ax: Any, system: System) -> None:
    """What the marks mean; only those that occur."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    def mark(label: str, **style: Any) -> Any:
        return Line2D([], [], label=label, color=style.pop("color", "black"), **style)

    heats = [bool(heater.gain) for heater in system.inputs.values()]
    marks = [(True, Patch(facecolor="white", edgecolor="black", label="lump")),
             (bool(system.ambients), Patch(facecolor="white", edgecolor="#666666", linestyle="--", label="ambient")),
             (bool(system.links), mark("heat path", color="#888888")),
             (bool(system.modules), mark("module: positive current pumps heat this way", linewidth=2.6, marker=">")),
             (bool(system.flows), mark("coolant carries heat this way", color="C0", linestyle="--", marker=">")),
             (any(sensor.lump for sensor in system.sensors.values()), mark("sensor", linestyle="", marker="o")),
             (any(heats), mark("heater", linestyle="", marker="^")),
             (not all(heats), mark("recorded column that heats nothing", linestyle="", marker="D"))]
    ax.legend(handles=[handle for there, handle in marks if there], loc="upper left", bbox_to_anchor=(0.0, -0.02),
              ncols=3, fontsize=7.5, frameon=False, borderaxespad=0.0, columnspacing=1.2)
