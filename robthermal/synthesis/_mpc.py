"""Model predictive control: a quadratic program in every sample, whose end is proven never to be left."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .._arrays import Array
from .._checks import quoted, whole_number
from .._control import control
from .._drawing import axes_for
from ..errors import InputError, Outcome
from ..export import Program as Source
from ..linear import Plant, read_plant
from ._arguments import held
from ._design import Design, RobustAgainst, as_system
from ._ellipsoid import shadow
from ._mpc_export import fallback, source
from ._mpc_limits import Limits, read_limits
from ._mpc_step import MpcStep, Prediction, Program
from ._mpc_terminal import Terminal, optimal, terminal
from ._outcomes import SynthesisCode
from ._plant import hidden_mode, say_mode, split

_LONGEST = 500  # samples of the horizon
_SHARES = (1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.05)  # of bounds by a function at the operating point, in turn
_REFERENCE = (1.0, 2.0)  # sizes of the exported starts, of the terminal set
_TRIED = 2000  # states of the terminal set at which such bounds are looked at


@dataclass(frozen=True)
class MpcDesign(Design):
    """A predictive controller, and what is proven of the end of its predictions.

    Parameters
    ----------
    controller : control.StateSpace
        The law u = K x of the terminal set only; what runs is `step`.
    value : float
        Proven bound of the cost from every start in the terminal set, its level; infinity where nothing is proven.
    lower : float
        Estimate of what the optimal law without limits costs from the worst of these starts.
    closed_loop : control.StateSpace
        Loop with the terminal law, from a push on the states to the states.
    certificates : list of Certificate
        Kind "ellipsoid", about the sampled plant in floats and K; `rt.verify` checks it again.
    robust_against : RobustAgainst
        What set of plants the claim covers.
    outcome : Outcome
        How it ended; its text is the remedy.
    method : str
        Program that gave the terminal set.
    solver : str
        What solved it.
    solve_time : float
        Time of the design with its proof [s].
    iterations : int
        Programs that were solved.
    plant : GeneralizedPlant or None
        Sampled plant with its states as measurements.
    terminal : Terminal
        Cost, law and set at the end of the prediction.
    program : Program
        The quadratic program of `step`.
    """

    terminal: Terminal = field(default_factory=lambda: Terminal(np.zeros((0, 0)), np.zeros((0, 0)), 0.0))
    program: Program | None = field(default=None, repr=False)

    @cached_property
    def horizon(self) -> int:
        """Number of samples that are predicted."""
        return 0 if self.program is None else len(self.program.prediction.law)

    def step(self, x: ArrayLike) -> MpcStep:
        """Solve the quadratic program of one state.

        Parameters
        ----------
        x : array_like, shape (n,)
            Measured state in deviations from the operating point [state units].

        Returns
        -------
        MpcStep
            Where no controls keep every limit, ``holds`` is False, the text names the limit, and the control is the one
            that misses least.

        Raises
        ------
        InputError
            A state of another size, or that is not finite; no terminal set.
        """
        program, state = self._read(x)
        return program.step(state)

    def _read(self, x: ArrayLike) -> tuple[Program, Array]:
        """The program and a state of its size."""
        if self.program is None:
            raise InputError("no terminal set was found", where="design", expected="a design that has one",
                             remedy=self.outcome.text)
        n = len(self.terminal.P)
        try:
            state = np.asarray(x, float)
        except (TypeError, ValueError):
            state = np.zeros(0)
        if state.shape != (n,) or not np.isfinite(state).all():
            raise InputError(f"x = {quoted(x)}", where="argument x", expected=f"{n} finite numbers")
        return self.program, state

    @property
    def has_source(self) -> bool:
        """Whether `export` writes C source: not of bounds by a Python function, and not without a terminal set."""
        return self.program is not None and self.program.limits.function is None

    @property
    def _no_source(self) -> str:
        if self.program is None:
            return "There is no terminal set, and so no program to write."
        return 'Bounds by a Python function cannot be written in C: state them as "rows": (G, H, g).'

    def _source(self, name: str) -> Source:
        if self.program is None:
            raise ValueError("has_source says so")
        return source(self.program, name, self.controller.input_labels, self.controller.output_labels,
                      self._said)

    def fallback(self, x: ArrayLike) -> Array:
        """What the C source applies where it finds no plan that keeps every limit: u = K x, moved to the limits.

        The limits of this sample are met in turn, those of the controls alone in the end. Nothing is proven of it.

        Parameters
        ----------
        x : array_like, shape (n,)
            Measured state in deviations from the operating point [state units].

        Returns
        -------
        ndarray, shape (m,)
            Control in deviations from the operating point [control units].

        Raises
        ------
        InputError
            A state of another size, or that is not finite; no terminal set; bounds by a function.
        """
        program, state = self._read(x)
        if program.limits.function is not None:
            raise InputError("the bounds of the controls are a function", where="design",
                             expected="limits that are numbers", remedy=self._no_source)
        return fallback(program, state)

    def plot(self, ax: Any = None) -> Any:
        """Draw the shadow of the terminal set on the first two states.

        Parameters
        ----------
        ax : matplotlib axes, optional
            Axes to draw into; default new ones.

        Returns
        -------
        matplotlib.axes.Axes
        """
        ax = axes_for(ax)
        if self.terminal.level > 0:
            shadow(ax, self.terminal.P, self.terminal.level, "terminal set")
        ax.set(xlabel="state 0 [its unit]", ylabel="state 1 [its unit]")
        return ax

    def _facts(self) -> dict[str, Any]:
        end = {"P": self.terminal.P, "K": self.terminal.K, "level": self.terminal.level}
        return super()._facts() | {"terminal": end, "horizon": self.horizon} | self._written()

    def _written(self) -> dict[str, Any]:
        """The program in numbers, and steps of it; nothing where there is no terminal set."""
        if self.program is None or self.plant is None:
            return {}
        own, limits = self.program, self.program.limits
        written = {"A": self.plant.A, "B": self.plant.B2, "Q": own.Q, "R": own.R, "G": limits.G, "H": limits.H,
                   "g": limits.g, "control_limits": "a function of the state, not written" if limits.function else
                   "all limits are rows of G x + H u <= g"}
        axes = np.sqrt(self.terminal.level) * np.linalg.inv(np.linalg.cholesky(self.terminal.P)).T
        starts = [size * column for size in _REFERENCE for column in axes.T]
        steps = [own.step(x) for x in starts]
        return {"program": written, "reference": {
            "x": np.array(starts), "control": np.array([one.control for one in steps]),
            "cost": np.array([one.cost for one in steps]), "feasible": [one.holds for one in steps]}}


def mpc(plant: control.StateSpace, *, horizon: int, Q: ArrayLike, R: ArrayLike, limits: Any,
        sample_time: float | None = None) -> MpcDesign:
    """Design a predictive controller with limits, and prove its terminal set.

    In every sample `step` minimizes the sum of x'Qx + u'Ru over the horizon and x'Px at its end, under all limits and
    with the end in {x'Px <= level}. The law u = K x is proven to keep that set and all limits in it, and to cost at
    most x'Px: hence, for the plant as given and programs solved exactly, what is feasible once stays feasible, and the
    state goes to zero. States, controls and limits are deviations from an operating point.

    Parameters
    ----------
    plant : control.StateSpace
        Inputs are the controls; its states are measured. A continuous plant is sampled with held controls.
    horizon : int
        Samples that are predicted, at most 500.
    Q : array_like, shape (n, n), (n,) or ()
        Weight of the states: a matrix, its diagonal, or one number for all.
    R : array_like, shape (m, m), (m,) or ()
        Weight of the controls, above zero.
    limits : float, array_like, callable or mapping
        Largest absolute values of the controls; or "control": (low, high), "state": (low, high), "rows": (G, H, g) with
        G x + H u <= g, which says limits of the currents that depend on temperatures linearly. A function of the state
        that returns (low, high) of the controls is followed along the predictions; it is not part of the proof.
    sample_time : float, optional
        Sample time [s]; may be left out for a sampled plant.

    Returns
    -------
    MpcDesign
        ``terminal`` has P, K and level. ``holds`` is False where no terminal set is proven, or where limits by a
        function were only looked at.

    Raises
    ------
    InputError
        Sizes that do not fit, weights that are not positive, a mode that the controls do not reach, limits that do not
        have the operating point inside.

    References
    ----------
    Kothare, Balakrishnan and Morari, Automatica 32 (1996); Mayne, Rawlings, Rao and Scokaert, Automatica 36 (2000).

    Examples
    --------
    >>> import control, robthermal as rt
    >>> cart = control.ss([[0, 1], [0, 0]], [[0], [1]], [[1, 0]], 0)
    >>> d = rt.design.mpc(cart, horizon=15, Q=[1, 0], R=0.1, limits={"control": (-1, 1), "state": (-5, 5)},
    ...                   sample_time=0.2)
    >>> d.holds, rt.verify(d.certificates[0]).valid
    (True, True)
    >>> move = d.step([1.0, 0.0])
    >>> move.holds, bool(-1 <= move.control[0] < 0)
    (True, True)
    """
    start = time.perf_counter()
    sampled = _sampled(plant, sample_time)
    n, m = sampled.B.shape
    steps = whole_number(horizon, "horizon", 1)
    if steps > _LONGEST:
        raise InputError(f"horizon = {steps}", where="argument horizon", expected=f"at most {_LONGEST}")
    weight_x, weight_u = _weight(Q, n, "Q", 0.0), _weight(R, m, "R", 1e-12)
    bounded = read_limits(limits, n, m)
    best = _best(sampled, weight_x, weight_u)
    end, certificate, words = _terminal(sampled, weight_x, weight_u, bounded, best)
    outcome = _outcome(end, certificate, words)
    program = None
    if end.level > 0:
        program = Program(Prediction.of(sampled, end.K, steps), weight_x, weight_u, bounded, end, sampled.dt)
    labels = [*plant.state_labels], [*plant.input_labels]
    K = Plant(np.zeros((0, 0)), np.zeros((0, n)), np.zeros((m, 0)), end.K, sampled.dt)
    loop = Plant(sampled.A + sampled.B @ end.K, np.eye(n), np.eye(n), np.zeros((n, n)), sampled.dt)
    least = end.level * float(np.linalg.eigvals(np.linalg.solve(end.P, best[0])).real.max())
    covers = RobustAgainst("Proven for the sampled plant as given in floats and its whole terminal set. A disturbance "
                           "or another plant is not covered." if certificate is not None else
                           "Nothing is proven, of this plant or of others.")
    return MpcDesign(as_system(K, *labels), end.level if outcome.ok else np.inf, least if end.level > 0 else -np.inf,
                     as_system(loop, [f"push of {one}" for one in labels[0]], labels[0]),
                     [] if certificate is None else [certificate], covers, outcome,
                     "matrix inequality of the terminal set (Kothare, Balakrishnan and Morari)", "Clarabel",
                     time.perf_counter() - start, 1, _measured(sampled), end, program)


def _terminal(plant: Plant, Q: Array, R: Array, limits: Limits, best: tuple[Array, Array]) -> tuple[Terminal, Any, str]:
    """Terminal set with its certificate; with bounds by a function, for constants that seem to lie inside of it."""
    if limits.function is None:
        return *terminal(plant, Q, R, limits, best), ""
    n = len(plant.A)
    low, high = limits.bounds(np.zeros(n))
    if not ((low < 0) & (high > 0)).all():
        raise InputError(f"bounds {low.tolist()} to {high.tolist()} of the controls at the operating point",
                         where="argument limits", expected="u = 0 strictly inside")
    directions = np.random.default_rng(0).standard_normal((_TRIED, n))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for share in _SHARES:
        found, certificate = terminal(plant, Q, R, limits.with_controls(share * low, share * high), best)
        if certificate is None:
            continue
        root = np.sqrt(found.level) * np.linalg.inv(np.linalg.cholesky(found.P)).T
        radii = np.sqrt(np.linspace(1 / _TRIED, 1, _TRIED))[:, None]
        seen = [limits.bounds(x) for x in radii * directions @ root.T]
        if all((one[0] <= share * low).all() and (one[1] >= share * high).all() for one in seen):
            return found, certificate, f"{(share * low).tolist()} to {(share * high).tolist()}"
    return Terminal(best[0], best[1], 0.0), None, ""


def _outcome(end: Terminal, certificate: Any, words: str) -> Outcome:
    if certificate is None:
        return SynthesisCode.NOT_FOUND.outcome(
            "No terminal set was proven around the operating point.",
            remedy="Allow more, scale states and controls, or weight the states a little.")
    if words:
        return SynthesisCode.NOT_CERTIFIED.outcome(
            f"The terminal set is certified for the constant limits {words} of the controls. That the function allows "
            f"them everywhere in the set was looked at in {_TRIED} states, not proven.",
            remedy='State the limits as "rows": (G, H, g), which are part of the proof.')
    return SynthesisCode.CERTIFIED.outcome(
        f"Certified: the terminal set x'Px <= {end.level:.6g} is never left under u = K x, which keeps all limits "
        "there and costs at most x'Px. The quadratic programs are solved in floats.")


def _best(plant: Plant, Q: Array, R: Array) -> tuple[Array, Array]:
    mode = hidden_mode(plant.A, plant.B, plant.dt)
    if mode is not None:
        raise InputError(f"not stabilisable: the mode at {say_mode(mode, plant.dt)}", where="argument plant",
                         expected="every mode on or beyond the boundary of stability within reach of the controls")
    best = optimal(plant, Q, R)
    if best is None:
        raise InputError("the cost without limits has no stable optimum", where="argument Q",
                         expected="weights that see every mode which does not decay by itself",
                         remedy="Weight all states a little.")
    return best


def _sampled(plant: Any, sample_time: object) -> Plant:
    """Plant with held controls, and its sample time."""
    found = read_plant(plant, "argument plant")
    if not isinstance(plant, control.StateSpace) or not len(found.A) or not found.B.shape[1]:
        raise InputError("no state space with states and controls", where="argument plant",
                         expected="a control.StateSpace whose states are measured")
    return held(found, sample_time)


def _measured(plant: Plant) -> Any:
    n, m = plant.B.shape
    whole = Plant(plant.A, np.hstack([np.eye(n), plant.B]), np.vstack([np.eye(n), np.eye(n)]),
                  np.zeros((2 * n, n + m)), plant.dt)
    return split(whole, n, m)


def _weight(value: ArrayLike, size: int, name: str, least: float) -> Array:
    """Symmetric weight, its eigenvalues at least ``least`` times the largest."""
    try:
        given = np.asarray(value, float)
        matrix = given if given.ndim == 2 else np.diag(np.broadcast_to(given, (size,)))
    except (TypeError, ValueError):
        matrix = np.zeros((0, 0))
    good = matrix.shape == (size, size) and np.isfinite(matrix).all() and np.array_equal(matrix, matrix.T)
    values = np.linalg.eigvalsh(matrix) if good else np.zeros(1)
    if not good or values[0] < least * values[-1] or not values[-1] > 0:
        raise InputError(f"{name} = {quoted(value)}", where=f"argument {name}",
                         expected=f"one number, {size} of them or a symmetric matrix, "
                                  + ("positive definite" if least else "positive semidefinite, not zero"))
    return matrix
