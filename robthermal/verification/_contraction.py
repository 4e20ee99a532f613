"""Kind "contraction": E x' = f(x, I) contracts in one norm over a box of temperatures and currents."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from flint import fmpq

from . import _energy, _lyapunov, _weighted
from ._contraction_problem import Contraction
from ._fields import margin_of
from ._heaters import read_heaters, say_heaters, with_rises
from ._kind import Kind, Proof, working_precision
from ._norm import NORMS, read_norm, say_rate
from ._numbers import round_down, show
from ._system import read_region, read_system, say_region
from ._uncertain import read_parameters, say_subject, worst_system


def read(system: Any, region: Any, evidence: Any, margin: Any) -> Contraction:
    """Return the exact problem, or raise InputError."""
    nominal = read_system(system, heaters=True)
    box = read_region(region, nominal)
    parameters = read_parameters(region)
    heaters, others = read_heaters(system, region, nominal.lumps, parameters)
    network = with_rises(worst_system(nominal, system, others, nonlinear=True), heaters)
    norm = read_norm(evidence, len(network.lumps))
    return Contraction(network, box, norm.method, norm.rate, margin_of(margin, "rate"), norm.weights, norm.matrix,
                       parameters, heaters)


def claim(problem: Contraction, machine: str) -> str:
    """Return the one sentence the data give."""
    box = say_region(problem.system, problem.region) + say_heaters(problem.heaters)
    return (f"The {say_subject(problem.system, problem.parameters, machine)}, contracts for all {box}: between any two "
            "trajectories under the same inputs, as long as both stay in this box (that they do is not part of this "
            f"claim), {NORMS[problem.method]} (method {problem.method}) {say_rate(problem.rate)}.")


def prove(problem: Contraction) -> Proof:
    """Prove the inequality of the method over the whole box, with the stored margin added to the rate."""
    with working_precision():
        if problem.method in ("sum", "max"):
            return _weighted.prove(problem)
        return _prove_matrix(problem)


def find_margin(problem: Contraction) -> dict[str, float]:
    """Return a margin that the checker proves, close to the largest [1/s]."""
    with working_precision():
        if problem.method in ("sum", "max"):
            extra = round_down(_weighted.largest_margin(problem))
        else:
            prove_rate = _prover(problem)
            extra = search(lambda value: prove_rate(problem.rate + fmpq(*value.as_integer_ratio())).valid,
                           round_down(problem.rate))
    return {"rate": shorten(extra)}


def shorten(value: float) -> float:
    """Return four digits of a margin, rounded to the safe side by about a thousandth."""
    return float(f"{value * 0.999:.4g}") if value > 0 else 0.0


def _prove_matrix(problem: Contraction) -> Proof:
    extra, prove_rate = max(problem.margin, fmpq(0)), _prover(problem)
    proof = prove_rate(problem.rate + extra)
    if proof.valid:
        return replace(proof, margins={"rate": round_down(extra)})
    if extra > 0 and prove_rate(problem.rate).valid:
        return Proof(False, f"stored margin {show(extra)} 1/s is larger than what can be proven: {proof.reason}")
    return proof


def _prover(problem: Contraction) -> Callable[[fmpq], Proof]:
    """Return the proof of the method for any rate."""
    return _energy.prover(problem) if problem.method == "energy" else partial(_lyapunov.prove, problem)


def search(proven: Callable[[float], bool], rate: float) -> float:
    """Bisect a proof itself: the largest additional rate that is still proven, to two per mille."""
    low, high = 0.0, max(rate, 1e-6)
    for _ in range(40):
        if not proven(high):
            break
        low, high = high, 2 * high
    for _ in range(40):
        if low > 0 and high - low <= 0.002 * high or high < 1e-9:
            break
        middle = (low + high) / 2 if low > 0 else high / 4
        low, high = (middle, high) if proven(middle) else (low, middle)
    return low


CONTRACTION = Kind("contraction", read, claim, prove, find_margin)
