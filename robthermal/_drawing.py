"""Where a result draws itself: into axes of the caller, or into a new figure."""

from __future__ import annotations

from typing import Any

from .errors import InputError

# The n-th sensor of a machine has the n-th color in every figure. The first six are of Okabe and Ito (2008): told apart
# with every common color vision; without the yellow, too pale on white. The others are told apart by dashes too.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9",
          "#8B62C4", "#7F8C1A", "#96613D", "#C2274B", "#2A9D9D", "#6B7A90")
_SOLID = 6  # curves
_DASHES = ("-", "--", ":", "-.")


def line_of(number: int) -> dict[str, str]:
    """Color and dashes of the n-th curve, for `Axes.plot`: the first six are solid, the next six dashed.

    Parameters
    ----------
    number : int
        Place of the curve among all channels, from 0; -1, -2, … take the first six colors from the other end.

    Returns
    -------
    dict

    Examples
    --------
    >>> line_of(0), line_of(6), line_of(-1)["linestyle"]
    ({'color': '#0072B2', 'linestyle': '-'}, {'color': '#8B62C4', 'linestyle': '--'}, '-')
    """
    rounds = max(number, -1 - number) // _SOLID
    color = COLORS[number % (len(COLORS) if number >= 0 else _SOLID)]
    return {"color": color, "linestyle": _DASHES[rounds % len(_DASHES)]}


def size_of(height: float) -> tuple[float, float]:
    """Size of a new figure of this height: as wide as the style in force says, so that its letters are as large as any.

    Parameters
    ----------
    height : float
        Height of the figure [inch].

    Returns
    -------
    tuple of float
        Width and height [inch].

    Examples
    --------
    >>> size_of(2.0)
    (6.4, 2.0)
    """
    from matplotlib import rcParams  # here: as in `axes_for`

    return float(rcParams["figure.figsize"][0]), height


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
