"""From a measured response and its covariance to the weight that robust synthesis asks for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .._arrays import Array
from .._checks import quoted
from .._control import control
from ..errors import InputError
from ..identify import FrequencyResponse
from ..linear import Plant, read_plant, responder
from ._arguments import choice
from ._design import as_system
from ._plant import to_sampled
from ._scalings import fitted

_BEYOND = 1e3  # times the last bin: the bound of the last one is kept up to there
_FLOOR = 1e-6  # of the largest bound: smaller ones count as this
_NEAR_NYQUIST = 0.4999 * np.pi  # of ωT/2
_FINE = 8  # points between two of the grid on which the weight is raised until it lies above


def uncertainty_weight(G: FrequencyResponse | Sequence[FrequencyResponse], model: control.StateSpace, *,
                       kind: str = "additive", probability: float = 0.99, order: int = 4) -> control.StateSpace:
    """Weight above what a model may be wrong by, as a measured response with its covariance shows it.

    A stable, minimum-phase W with \\|W\\| >= \\|G - model\\| + radius at every bin, the radius of circles that hold the
    true response at all bins at once with the probability. Between two bins it lies above the larger of both, below the
    first and above the last bin above those: that the plant has no resonance between bins is assumed.

    Parameters
    ----------
    G : FrequencyResponse or sequence of them
        Response of the plant with its covariance; of several records or plants each is covered.
    model : control.StateSpace or control.TransferFunction
        Nominal model, continuous or sampled; the weight is in its time domain.
    kind : {"additive", "multiplicative"}
        plant = model + Δ W, or plant = (1 + Δ W) model (uncertainty at the outputs); \\|Δ\\| <= 1, of matrices the
        largest singular value.
    probability : float
        Probability that the circles hold the true response at all bins, entries and records at once [-].
    order : int
        Number of states of the weight.

    Returns
    -------
    control.StateSpace
        W, one input and one output.

    Raises
    ------
    InputError
        A response without covariance or with bins that are not determined, another size than the model's, a model that
        is singular at a bin (kind "multiplicative"), a probability outside of (0, 1), an order outside of 1 to 12.

    References
    ----------
    Skogestad and Postlethwaite, Multivariable Feedback Control (2005), sections 7.4 and 8.2.

    Examples
    --------
    >>> import control, numpy as np, robthermal as rt
    >>> f = np.geomspace(1e-3, 1.0, 60)
    >>> plant, model = control.tf([2.0], [30, 1]), control.tf([1.8], [25, 1])
    >>> G = rt.identify.FrequencyResponse(
    ...     frequencies=f, response=plant(2j * np.pi * f)[None, None], noise_covariance=np.full((1, 1, 60), 1e-4),
    ...     gram=np.ones((1, 1, 60)), degrees_of_freedom=np.full(60, 50), input_names=["q"], output_names=["T"],
    ...     sample_time=1.0, n_samples=1000, method="made for an example")
    >>> W = rt.design.uncertainty_weight(G, model)
    >>> bool(np.all(abs(W(2j * np.pi * f)) > abs(plant(2j * np.pi * f) - model(2j * np.pi * f))))
    True
    """
    choice("kind", kind, ("additive", "multiplicative"))
    if isinstance(order, bool) or not isinstance(order, (int, np.integer)) or not 1 <= order <= 12:
        raise InputError(f"order = {quoted(order)}", where="argument order", expected="a whole number from 1 to 12")
    number = isinstance(probability, (int, float)) and not isinstance(probability, bool)
    if not number or not 0 < probability < 1:
        raise InputError(f"probability = {quoted(probability)}", where="argument probability",
                         expected="a number between 0 and 1")
    nominal = read_plant(model, "argument model")
    listed = list(G) if isinstance(G, Sequence) else [G]
    if not listed:
        raise InputError("no response", where="argument G", expected="a FrequencyResponse, or several")
    curves = [_bound(one, nominal, kind, 1 - (1 - probability) / len(listed),
                     "argument G" if len(listed) == 1 else f"argument G[{k}]") for k, one in enumerate(listed)]
    omega, bound = _envelope(curves, nominal.dt)
    found = _above(omega, bound, int(order), nominal.dt)
    return as_system(found, ["in"], ["out"])


def _bound(G: Any, model: Plant, kind: str, probability: float, where: str) -> tuple[Array, Array]:
    """Frequencies above zero [rad/s] and the largest distance of the plants in the circles from the model."""
    if not isinstance(G, FrequencyResponse):
        raise InputError(f"G is a {type(G).__name__}", where=where, expected="a FrequencyResponse (rt.identify)")
    if not G.has_covariance:
        raise InputError("a response without covariance", where=where, expected="one that says how uncertain it is",
                         remedy="Estimate it with rt.identify.lpm or another method of that package.")
    if G.response.shape[:2] != model.D.shape:
        raise InputError(f"a response with {G.response.shape[1]} inputs and {G.response.shape[0]} outputs; the model "
                         f"has {model.D.shape[1]} and {model.D.shape[0]}", where=where, expected="the same")
    inside = G.frequencies > 0
    if model.dt:
        inside &= G.frequencies <= 0.5 / model.dt
    omega = 2 * np.pi * G.frequencies[inside]
    if len(omega) < 3:
        raise InputError(f"{len(omega)} bins above zero{' and below Nyquist' if model.dt else ''}", where=where,
                         expected="at least 3")
    count = len(omega) * model.D.size
    radius = np.moveaxis(G.confidence_radius(1 - (1 - probability) / count)[:, :, inside], 2, 0)
    center = np.moveaxis(G.response[:, :, inside], 2, 0)
    lost = ~(np.isfinite(center) & np.isfinite(radius)).all(axis=(1, 2))
    if lost.any():
        raise InputError(f"{int(lost.sum())} bins are not determined, the first at {omega[lost][0] / (2 * np.pi):.4g} "
                         "Hz", where=where, expected="a finite response and radius at every bin",
                         remedy="Cut them off with G.between.")
    nominal = responder(model)(omega)
    gap = center - nominal
    if kind == "multiplicative":
        inverse = _inverses(nominal, omega, where)
        gap, radius = gap @ inverse, radius @ abs(inverse)
    # entries of size up to R: the largest singular value is at most that of R
    return omega, np.linalg.norm(gap, 2, axis=(1, 2)) + np.linalg.norm(radius, 2, axis=(1, 2))


def _inverses(nominal: Array, omega: Array, where: str) -> Array:
    if nominal.shape[1] != nominal.shape[2]:
        raise InputError(f"a model with {nominal.shape[2]} inputs and {nominal.shape[1]} outputs",
                         where="argument model", expected="as many outputs as inputs for kind \"multiplicative\"",
                         remedy="Take \"additive\".")
    least = np.linalg.svd(nominal, compute_uv=False)[:, -1]
    k = int(least.argmin())
    if not least[k] > 1e-12 * np.linalg.norm(nominal, 2, axis=(1, 2)).max():
        raise InputError(f"the model has no inverse at {omega[k] / (2 * np.pi):.4g} Hz", where=where,
                         expected="a model that is regular at every bin", remedy="Take kind \"additive\".")
    return np.linalg.inv(nominal)


def _envelope(curves: Sequence[tuple[Array, Array]], dt: float) -> tuple[Array, Array]:
    """All bins, the middles between them, zero and the end, with the larger bound of the neighbors of every curve."""
    bins = np.unique(np.concatenate([omega for omega, _ in curves]))
    end = np.pi / dt if dt else _BEYOND * bins[-1]
    grid = np.unique(np.concatenate([[0.0], bins, np.sqrt(bins[1:] * bins[:-1]), [end]]))
    found = np.zeros(len(grid))
    for omega, bound in curves:
        right = np.minimum(np.searchsorted(omega, grid, side="left"), len(omega) - 1)
        left = np.maximum(np.searchsorted(omega, grid, side="right") - 1, 0)
        found = np.maximum(found, np.maximum(bound[left], bound[right]))
    return grid, found


def _above(omega: Array, bound: Array, order: int, dt: float) -> Plant:
    """Stable, minimum-phase system above the bound everywhere on the grid and between its points."""
    target = np.maximum(bound, _FLOOR * bound.max(initial=0.0))
    if not target.any():
        raise InputError("the model and the response are equal, without uncertainty", where="argument G",
                         expected="a response with noise, or one that differs from the model")
    axis = np.tan(np.minimum(omega * dt / 2, _NEAR_NYQUIST)) if dt else omega  # the bilinear map, an axis for an axis
    W = fitted(axis, target, order)
    share = np.linspace(0, 1, _FINE, endpoint=False)
    fine = np.concatenate([(axis[:-1, None] + share * np.diff(axis)[:, None]).ravel(), axis[-1:]])
    between = np.concatenate([np.repeat(np.maximum(target[:-1], target[1:]), _FINE), target[-1:]])
    between[::_FINE] = np.minimum(between[::_FINE], target)  # at a point of the grid its own bound
    factor = 1.0001 * float(np.max(between / abs(responder(W)(fine)[:, 0, 0])))
    W = Plant(W.A, W.B, factor * W.C, factor * W.D, 0.0)
    return to_sampled(W, 1.0, dt) if dt else W
