"""Does K0 stabilize a measured plant? Encirclements of det(I + P K0), counted for every plant in a confidence set.

The count is that of det(I + P K0)/det(I + P0 K0) over positive and negative frequencies, joined by straight lines. Of a
diagonal plant each loop is counted by itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..._arrays import Array
from ...errors import InputError
from ._loop import Loop

_TURN = 0.9 * np.pi  # phase step between two frequencies beyond which turns cannot be counted
_LARGEST_S = 1.0 + 1e-9  # of the model's |S| where bins are left out: |1 + P0 C0| keeps off zero by 1, below crossover
_JOINED = 400  # frequencies at which the model is looked at there
_FAR = 1e4  # times the last frequency: as far as the model of a continuous loop is looked at


@dataclass(frozen=True, eq=False)
class MeasuredLoop:
    """One measured plant with K0, over its decided bins.

    Parameters
    ----------
    omega : ndarray, shape (n_f,)
        Frequencies of the decided bins [rad/s].
    ratios : ndarray, shape (n_series, n_f)
        det(I + P K0)/det(I + P0 K0): of each loop of a diagonal plant, or of all together.
    swings : ndarray, shape (n_series, n_f)
        Largest change of the phase of each ratio within the confidence set [rad]; 0 without covariance.
    covered : bool
        Whether there is a confidence set.
    where : str
        Name of the argument, for messages.
    """

    omega: Array
    ratios: Array
    swings: Array
    covered: bool
    where: str

    def expect_stable(self) -> None:
        """Refuse a loop that winds otherwise than that of the model, or of which that cannot be told."""
        for ratio, swing in zip(self.ratios, self.swings, strict=True):
            if self.covered:
                self._expect_one_count(ratio, swing)
            turns = _turns(ratio)
            if turns:
                raise self._unstable(turns)
            if np.max(np.abs(np.angle(ratio[1:] / ratio[:-1])), initial=0.0) > _TURN:
                raise InputError("the phase of det(I + P_frf K0) jumps by more than 160 degrees between two "
                                 "frequencies", where=self.where,
                                 expected="a grid on which encirclements can be counted",
                                 remedy="Measure with a finer grid, or with less noise.")

    def _expect_one_count(self, ratio: Array, swing: Array) -> None:
        """Two plants in the set have the same count if no straight line between neighboring sets meets the origin."""
        steps = np.abs(np.angle(ratio[1:] / ratio[:-1])) + swing[1:] + swing[:-1] >= np.pi
        unsure = np.concatenate([steps, [False]]) | np.concatenate([[False], steps])
        for end in (0, -1):  # joined to its mirror image at negative frequencies, across zero and Nyquist
            unsure[end] |= bool(np.abs(np.abs(np.angle(ratio[end])) - np.pi / 2) <= swing[end])
        if unsure.any():
            raise undecided(self.omega[unsure], self.where, "plants in the confidence set encircle the origin "
                            "differently often")

    def _unstable(self, turns: int) -> InputError:
        times = f"{abs(turns)} more time{'s' * (abs(turns) > 1)}"
        what = (f"the controllers do not stabilize this measured plant: det(I + P_frf K0) encircles the origin {times} "
                "than det(I + P0 K0)")
        if self.covered:
            what += ", for every plant in its confidence set"
        else:
            what += "; without covariance noise cannot be told from an unstable loop"
        return InputError(what, where=self.where,
                          expected="a plant that K0 stabilizes (it was measured in closed loop)",
                          remedy="Check sign, units (rad/s, Hz) and the order of inputs and outputs"
                                 + ("." if self.covered else ", or give a response with covariance."))


def expect_joined(loops: tuple[Loop, ...], left_out: Array, first: float, where: str) -> None:
    """Refuse to join a count across bins that are left out, from zero to `first` [rad/s], unless |1 + P0 C0| >= 1.

    There 1 + PC = (1 + P0 C0)(1 + T0 (P - P0)/P0) with |T0| = |1 - S0| <= 2: it does not vanish as long as the plant is
    within 1/|T0| of the model, half of it at least, which is the assumption.
    """
    omega = np.unique(np.concatenate([left_out[left_out > 0], first * np.geomspace(1e-4, 1.0, _JOINED)]))
    for number, loop in enumerate(loops, 1):
        close = np.abs(loop.S.at(omega)) > _LARGEST_S
        if close.any():
            raise undecided(left_out, where, f"the model's own |1 + P{number} C{number}| falls below 1 there "
                            f"(at {omega[close][0] / (2 * np.pi):.4g} Hz)")


def expect_beyond_crossover(loops: tuple[Loop, ...], last: float, where: str) -> None:
    """Refuse a count from a response that ends at `last` [rad/s] where the model's |T0| still exceeds 1 above.

    Beyond the last bin 1 + PC = (1 + P0 C0)(1 + T0 (P - P0)/P0) does not vanish as long as the plant is within 1/|T0|
    of the model: all of it with |T0| <= 1. Where |T0| is larger nothing measured says that the loop is stable.
    """
    for number, loop in enumerate(loops, 1):
        top = np.pi / loop.P.dt if loop.P.dt else _FAR * last
        omega = np.geomspace(last, top, _JOINED) if top > last else np.array([last])
        T = np.abs(1 - loop.S.at(omega))
        k = int(np.argmax(T))
        if T[k] > _LARGEST_S:
            end, needed = last / (2 * np.pi), omega[np.nonzero(T > _LARGEST_S)[0][-1]] / (2 * np.pi)
            raise InputError(f"the response ends at {end:.4g} Hz, and the model's |T{number}| is {T[k]:.3g} at "
                             f"{omega[k] / (2 * np.pi):.4g} Hz: nothing measured tells whether the loop is stable",
                             where=where, expected=f"a response up to {needed:.4g} Hz at least",
                             remedy="Measure further up, or say measured_in_closed_loop = true if it was measured "
                             "while these controllers ran.")


def undecided(omega: Array, where: str, why: str, circles: bool = False, instead: str = "") -> InputError:
    """The refusal where a measurement does not tell, which is not that of an unstable loop.

    Parameters
    ----------
    omega : ndarray
        Frequencies of the bins in question [rad/s].
    where : str
        Name of the argument.
    why : str
        What the bins hold.
    circles : bool
        Whether it is the circles that are too large, for the envelope as for the count.
    instead : str
        What else can be done, besides measuring.
    """
    low, high = omega.min() / (2 * np.pi), omega.max() / (2 * np.pi)
    closed = "measured_in_closed_loop = true does not help: it replaces the count, not the circles." if circles else \
        "Or say measured_in_closed_loop = true if it was measured while these controllers ran."
    measure = f"Measure {low:.4g} … {high:.4g} Hz longer or with more excitation."
    return InputError(f"whether the controllers stabilize this plant cannot be decided from bins {low:.4g} … "
                      f"{high:.4g} Hz: {why}", where=where,
                      expected="confidence sets in which every plant has the same loop",
                      remedy=" ".join(part for part in (measure, instead, closed) if part))


def _turns(ratio: Array) -> int:
    closed = np.concatenate([ratio, ratio[::-1].conj()])  # negative frequencies, joined by straight lines at the ends
    return round(float(np.sum(np.angle(np.roll(closed, -1) / closed))) / (2 * np.pi))
