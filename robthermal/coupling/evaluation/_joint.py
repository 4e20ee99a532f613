"""Several axes: one coupling per degree of freedom, one verdict on all of them, interaction between axes included."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING, Any

from ...errors import InputError, Outcome
from ...verification import Certificate
from .._outcomes import CouplingCode
from ..factors import CoprimeFactors, Loop, Uncertainty, from_factors, intervals_of
from ..problem import Problem, Proofs, Subsystem, youla_parameter
from ..systems import apart
from ._filters import Filters

if TYPE_CHECKING:
    from ..factors import Measured


@dataclass(frozen=True, eq=False)
class Joint:
    """Verdict on several axes together.

    Parameters
    ----------
    axes : dict of Filters
        Name of the axis: its coupling.
    uncertainty : Uncertainty or None
        Of all axes together, channels in order: both subsystems of the first axis, then of the next.
    robust : float
        Bound of rho(\\|Delta_k\\| R) of all axes together, proven at every frequency; without measured plants the
        largest of the axes.
    worst_frequency : float
        Where it is about attained [rad/s].
    robustly_stable : bool
        Proven for every plant under the envelope.
    holds : bool
        This, and everything that was asked of each axis.
    certificates : dict of Certificate
        By axis and what they prove.
    outcome : Outcome
        What holds, or why not.

    Examples
    --------
    >>> import control
    >>> import robthermal as rt
    >>> P, C = control.tf([0.01], [1, -0.99], 0.01), control.tf([20.0], [1], 0.01)
    >>> filters = rt.coupling.evaluate(P, P, C, C, X_hat=-0.9)
    >>> rt.coupling.joint({"x": filters, "y": filters}).outcome.code
    'nominal'
    """

    axes: dict[str, Filters]
    uncertainty: Uncertainty | None
    robust: float
    worst_frequency: float
    robustly_stable: bool
    holds: bool
    certificates: dict[str, Certificate]
    outcome: Outcome

    def __str__(self) -> str:
        lines = [f"{name:<12} {filters.verdict:<8} robust {filters.norms['robust']:.4g}"
                 for name, filters in self.axes.items()]
        last = f"{'together':<12} {'robust' if self.robustly_stable else '-':<8} robust {self.robust:.4g}"
        return "\n".join([self.outcome.text, *lines, last])


def joint(axes: Mapping[str, Filters], measured: Measured | None = None) -> Joint:
    """Verdict on several axes, each with its own plants, controllers and filters.

    Each axis of machine 1 is coupled to the same axis of machine 2. The models of the axes are independent; how axes
    act on each other belongs into the measured plants.

    Parameters
    ----------
    axes : mapping of str to Filters
        Coupling of each axis, from `synthesize` or `evaluate`, of one sample time.
    measured : square frequency response, or list of them, optional
        Measured plants of all axes together, 2m inputs and outputs for m axes: both subsystems of the first axis, then
        of the next. None: the axes are taken not to act on each other, and each keeps its own verdict.

    Returns
    -------
    Joint

    Raises
    ------
    InputError
        No axis, different sample times, or measured plants as in `dual_youla`.

    Examples
    --------
    See :class:`Joint`.

    >>> import robthermal as rt
    >>> rt.coupling.joint.__name__
    'joint'
    """
    named = dict(axes) if isinstance(axes, Mapping) else {}
    if not named or not all(isinstance(filters, Filters) for filters in named.values()):
        raise InputError(f"axes = {type(axes).__name__}", where="joint", expected="a dict of axis name to Filters")
    _expect_one_rate({name: filters.problem for name, filters in named.items()})
    certificates = {f"{name}: {what}": proof for name, filters in named.items()
                    for what, proof in filters.proofs.items()}
    if measured is None:
        worst = max(named.values(), key=lambda filters: filters.norms["robust"])
        return _verdict(named, None, worst.norms["robust"], worst.worst_frequency, certificates,
                        all(filters.verdict == "robust" for filters in named.values()))
    halves = [half for filters in named.values() for half in (filters.problem.one, filters.problem.two)]
    uncertainty = from_factors(measured, CoprimeFactors(tuple(_loop(half) for half in halves)), "measured")
    delta = reduce(apart, [youla_parameter(filters.problem, filters.X_hat, filters.Y_hat)
                           for filters in named.values()])
    proofs = Proofs(prove=True)
    robust, where = proofs.radius(delta, intervals_of(uncertainty, halves[0].P.dt))
    certificates |= {f"together: {what}": proof for what, proof in proofs.certificates.items()}
    return _verdict(named, uncertainty, robust, where, certificates, True)


def _verdict(axes: dict[str, Filters], uncertainty: Uncertainty | None, robust: float, where: float,
             certificates: dict[str, Certificate], known: bool) -> Joint:
    robustly = known and robust < 1 and all(filters.nominally_stable for filters in axes.values())
    missed = [name for name, filters in axes.items() if not filters.holds]
    if missed:
        outcome = CouplingCode.AXIS.outcome(f"Not everything that was asked holds for {', '.join(missed)}:")
    elif uncertainty is not None and not robustly:
        outcome = CouplingCode.NOT_ROBUST.outcome(
            "Each axis is proven by itself, all together are not for every plant under the envelope.",
            remedy="Design the axes with more margin, or make them act less on each other.")
    elif uncertainty is not None:
        outcome = CouplingCode.ROBUST.outcome("All axes are proven stable for every plant under the envelope, "
                                              "interaction between axes included.")
    else:
        code = CouplingCode.ROBUST if robustly else CouplingCode.NOMINAL
        outcome = code.outcome("Each axis is proven by itself. Assumed: the axes do not act on each other.")
    return Joint(axes, uncertainty, robust, where, robustly, outcome.ok, certificates, outcome)


def _loop(half: Subsystem) -> Loop:
    return Loop(half.P, half.C, half.Z, half.Q, half.S, half.Nk, half.Dk)


def _expect_one_rate(problems: Mapping[str, Problem]) -> None:
    times: dict[str, Any] = {name: problem.dt for name, problem in problems.items()}
    if len(set(times.values())) > 1:
        listed = ", ".join(f"{name} has dt = {dt:g} s" for name, dt in times.items())
        raise InputError(f"different sample times: {listed}", where="joint", expected="one dt for all axes")
