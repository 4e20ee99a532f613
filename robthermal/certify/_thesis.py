"""The thesis's own current bound, corrected: what it allows, beside what is certified."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse.csgraph import connected_components

from .._celsius import ADD_ZERO, ZERO_CELSIUS
from .._drawing import axes_for
from .._pandas import pd
from ..errors import InputError
from ..thermal import Equations, System
from ._sections import system_section

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ThesisBounds:
    """Bounds (5.31)-(5.32) of Evers (2021) for V = xᵀEx, as derived and as printed.

    They are no safety limits: V is centered at 0 K and says nothing about thermal runaway.

    Parameters
    ----------
    hot, cold : ndarray
        Temperatures of the modules' hot and cold faces [K].
    lower, upper : dict
        Module to the two roots of V̇₂ = 0 [A]; nan where V̇₂ < 0 for no current.
    decay : dict
        Module to (λ_H, λ_C), least eigenvalues of Q_H and Q_C [W/K].
    """

    hot: Array
    cold: Array
    lower: dict[str, Array]
    upper: dict[str, Array]
    decay: dict[str, tuple[float, float]]

    @property
    def printed(self) -> dict[str, tuple[Array, Array]]:
        """Module to the printed interval [−β, β]: the upper root with both signs, unsafe when heating [A]."""
        return {name: (-upper, upper) for name, upper in self.upper.items()}

    def table(self) -> pd.DataFrame:
        """Corrected and printed bounds [A] by temperatures [K]; a row per module and point."""
        rows = [{"module": name, "hot [K]": h, "cold [K]": c, "lower [A]": low, "upper [A]": up,
                 "printed lower [A]": -up, "printed upper [A]": up}
                for name in self.lower for h, c, low, up in zip(self.hot.ravel(), self.cold.ravel(),
                                                                self.lower[name].ravel(), self.upper[name].ravel(),
                                                                strict=True)]
        return pd.DataFrame(rows)

    def __str__(self) -> str:
        return self.table().round(3).to_string(index=False)

    def plot(self, limits: Mapping[str, float] | None = None, ax: Any = None) -> Any:
        """Plot the bounds over the cold face's temperature, with other limits as lines; returns the matplotlib axes.

        Parameters
        ----------
        limits : mapping, optional
            Label to current [A], for example I* and certified limits.
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.
        """
        ax = axes_for(ax)
        name = next(iter(self.lower))
        order = np.argsort(self.cold.ravel())
        cold = self.cold.ravel()[order] - ZERO_CELSIUS
        upper, lower = self.upper[name].ravel()[order], self.lower[name].ravel()[order]
        ax.plot(cold, upper, "C0", label=f"(5.32), upper root, module {name}")
        ax.plot(cold, lower, "C0--", label="lower root, corrected")
        ax.plot(cold, -upper, "C3:", label="lower bound as printed")
        for k, (label, current) in enumerate((limits or {}).items()):
            ax.axhline(current, color=f"C{k + 4}", label=f"{label}: {current:.3g} A")
        ax.set(xlabel="cold face [°C]", ylabel="current [A]", title="the thesis's bound is no safety limit")
        ax.legend()
        return ax


def thesis_bounds(system: System, hot: ArrayLike, cold: ArrayLike) -> ThesisBounds:
    """Evaluate the thesis's current bounds (5.31)-(5.32), corrected, for every module.

    With a = R(x_h + x_c), b = S(x_h² − x_c²), c = 2K(x_c − x_h)(x_h − x_c) − λ_H x_h² − λ_C x_c² the interval is
    (−b ± √(b² − ac))/a; S, R, K at (x_h + x_c)/2; P_h = P_c = 1, λ the least eigenvalues of −2A of the network of links
    on either side.

    Parameters
    ----------
    system : System
        Network whose hot and cold sides are connected by modules only.
    hot, cold : array_like
        Temperatures of the faces [K].

    Returns
    -------
    ThesisBounds

    Raises
    ------
    InputError
        No modules, Celsius, or sides that links connect.

    References
    ----------
    Evers (2021), (5.31)-(5.32), and its errata.

    Examples
    --------
    >>> import robthermal as rt
    >>> bounds = rt.certify.thesis_bounds(rt.systems.two_module(), 298.0, 278.0)
    >>> round(float(bounds.lower["m1"]), 2), round(float(bounds.upper["m1"]), 2)
    (-3.8, 3.29)
    """
    system_section(system)  # refuses what is no system
    if not system.modules:
        raise InputError("the system has no thermoelectric module", where="argument system")
    xh, xc = _kelvin(hot, "hot"), _kelvin(cold, "cold")
    xh, xc = (np.array(x) for x in np.broadcast_arrays(xh, xc))
    lower, upper, decay = {}, {}, _decay(system)
    for name, module in system.modules.items():
        S, R, K = (p.value + p.slope * ((xh + xc) / 2 - module.reference_temperature)
                   for p in (module.seebeck, module.resistance, module.conductance))
        a, b = R * (xh + xc), S * (xh**2 - xc**2)
        c = -2 * K * (xh - xc) ** 2 - decay[name][0] * xh**2 - decay[name][1] * xc**2
        with np.errstate(invalid="ignore"):  # nan says: no current at all
            root = np.sqrt(b**2 - a * c)
        lower[name], upper[name] = (-b - root) / a, (-b + root) / a
    return ThesisBounds(xh, xc, lower, upper, decay)


def _decay(system: System) -> dict[str, tuple[float, float]]:
    """Least eigenvalues of −2A of the links on the hot and on the cold side of every module."""
    eq, index = Equations(system), {name: i for i, name in enumerate(system.lumps)}
    A = eq.A.tolil()
    for module in system.modules.values():
        h, c, K = index[module.hot], index[module.cold], module.conductance.value
        A[h, h] += K
        A[c, c] += K
        A[h, c] -= K
        A[c, h] -= K
    links = A.toarray()
    _, side = connected_components(np.abs(links) > 1e-12, directed=False)
    least = {int(k): float(np.linalg.eigvalsh(-2 * links[np.ix_(side == k, side == k)])[0]) for k in np.unique(side)}
    found = {}
    for name, module in system.modules.items():
        h, c = int(side[index[module.hot]]), int(side[index[module.cold]])
        if h == c:
            raise InputError(f"links connect the hot and the cold side of module {name!r}", where="argument system",
                             expected="the structure of Evers (2021), (5.19): sides connected by modules only")
        found[name] = (least[h], least[c])
    return found


def _kelvin(value: ArrayLike, argument: str) -> Array:
    try:
        temperatures = np.asarray(value, float)
    except (TypeError, ValueError):
        raise InputError(f"{value!r} is not a temperature", where=f"argument {argument}", expected="kelvin") from None
    if not temperatures.size or not np.isfinite(temperatures).all() or temperatures.min() < 150.0:
        raise InputError(f"smallest value {temperatures.min(initial=np.inf):.6g}", where=f"argument {argument}",
                         expected="finite temperatures in kelvin", remedy=ADD_ZERO)
    return temperatures
