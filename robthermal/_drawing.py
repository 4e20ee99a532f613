"""Where a result draws itself: into axes of the caller, or into a new figure."""

from __future__ import annotations

from typing import Any

from .errors import InputError

# Okabe and Ito (2008): told apart with every common color vision; without the yellow, too pale on white. The n-th
# sensor of a machine has the n-th color in every figure.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")


def axes_for(ax: Any, **figure: Any) -> Any:
    """`ax`, or the axes of a new figure.

    Parameters
    ----------
    ax : matplotlib axes or None
        Axes of the caller.
    **figure
        Keywords of a new figure, for example its size.

    Raises
    ------
    InputError
        For anything else, for example an array of axes.

    Examples
    --------
    >>> axes_for(None).get_title()
    ''
    """
    # Imported here: matplotlib is slow to load, and most programs draw nothing.
    from matplotlib import pyplot
    from matplotlib.axes import Axes

    if ax is None:
        return pyplot.subplots(layout="constrained", **figure)[1]
    if not isinstance(ax, Axes):
        raise InputError(f"ax is of type {type(ax).__name__}", where="argument ax", expected="one matplotlib axes",
                         remedy="Take one of them: axes[0], or axes[0, 0].")
    return ax
