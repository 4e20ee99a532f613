"""Is a module wired the wrong way round? Decided from a record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np

from ..errors import Diverged, InputError, Outcome
from ..signals import Record
from ..thermal import System, simulate
from ._modules import check_system
from ._numbers import expect
from ._outcomes import DesignCode

_CLEAR = 4.0  # the misfit of the other wiring is this many times smaller in variance
_MOST = 6  # modules: all wirings are compared


@dataclass(frozen=True)
class Polarity:
    """Wirings of the modules, compared on a record.

    Parameters
    ----------
    reversed : tuple of str
        Modules that look reversed; empty when the wiring of the file fits best.
    misfit : dict
        Tuple of reversed modules to root-mean-square misfit of all sensors [K]; infinite where the simulation
        diverged.
    outcome : Outcome
        "as_declared", "reversed" or "undecided".
    """

    reversed: tuple[str, ...]
    misfit: Mapping[tuple[str, ...], float]
    outcome: Outcome

    def __str__(self) -> str:
        return self.outcome.text

    def require(self) -> None:
        """Refuse a system whose modules are reversed in the data.

        Raises
        ------
        InputError
            With the modules to correct.
        """
        if self.outcome.code == "reversed":
            raise InputError(f"modules {', '.join(self.reversed)} are reversed in the data", where="argument system",
                             expected="positive current from cold to hot", remedy=self.outcome.text)


def check_polarity(system: System, record: Record) -> Polarity:
    """Compare every wiring of the modules with a record: which currents have the wrong sign?

    Parameters
    ----------
    system : System
        As declared; it need not be calibrated.
    record : Record
        With currents that change sign or size, and at least one sensor.

    Returns
    -------
    Polarity
        Undecided when the data do not separate the wirings by a factor of two in root-mean-square misfit.

    Raises
    ------
    InputError
        No module, no sensor in the record, no current, more than six modules.

    Examples
    --------
    >>> import numpy as np, robthermal as rt
    >>> system = rt.systems.two_module()
    >>> drive = np.column_stack([np.repeat([0.0, 0.5], 100), np.zeros(200)])
    >>> wired_wrong = rt.Record(sample_time=1.0, inputs=-drive, outputs=np.zeros((200, 0)), input_names=["m1", "m2"],
    ...                         output_names=[])
    >>> run = rt.thermal.simulate(system, wired_wrong)
    >>> data = rt.Record(sample_time=1.0, inputs=drive, outputs=run.outputs, input_names=["m1", "m2"],
    ...                  output_names=run.output_names)
    >>> rt.design.check_polarity(system, data).reversed
    ('m1',)
    """
    check_system(system)
    expect(record, Record, "record", "rt.read_record")
    sensors = [name for name in system.thermometers if name in record.output_names]
    driven = [name for name in system.modules if name in record.input_names and np.ptp(record[name]) > 0]
    if not sensors or not driven:
        raise InputError("no sensor of the system" if not sensors else "no module current that changes",
                         where="argument record", expected="a current step or more, and its response",
                         remedy="Step the current of every module once.")
    if len(driven) > _MOST:
        raise InputError(f"{len(driven)} modules are driven", where="argument record", expected=f"at most {_MOST}",
                         remedy="Step them a few at a time.")
    misfit = {}
    for signs in product((1.0, -1.0), repeat=len(driven)):
        flipped = tuple(name for name, sign in zip(driven, signs, strict=True) if sign < 0)
        misfit[flipped] = _misfit(system, record, flipped, sensors)
    best = min(misfit, key=lambda flipped: misfit[flipped])
    return Polarity(*_judge(best, misfit))


def _judge(best: tuple[str, ...], misfit: dict[tuple[str, ...], float]) -> tuple[tuple[str, ...], dict, Outcome]:
    others = min(value for flipped, value in misfit.items() if flipped != best)
    if not np.isfinite(misfit[best]) or others**2 < _CLEAR * misfit[best] ** 2:
        return (), misfit, DesignCode.UNDECIDED.outcome(
            f"The wirings fit almost equally badly, {misfit[best]:.3g} and {others:.3g} K:")
    if not best:
        return (), misfit, DesignCode.AS_DECLARED.outcome(
            f"The declared wiring fits best, {misfit[best]:.3g} K against {others:.3g} K.")
    names = ", ".join(best)
    return best, misfit, DesignCode.REVERSED.outcome(
        f"{names}: reversed polarity fits the data with {misfit[best]:.3g} K, the declared one with "
        f"{misfit[()]:.3g} K.")


def _misfit(system: System, record: Record, flipped: tuple[str, ...], sensors: list[str]) -> float:
    signs = np.array([-1.0 if name in flipped else 1.0 for name in record.input_names])
    turned = Record(sample_time=record.sample_time, inputs=record.inputs * signs, outputs=record.outputs,
                    input_names=record.input_names, output_names=record.output_names, averaged=record.averaged)
    try:
        run = simulate(system, turned)
    except Diverged:
        return float("inf")
    # offsets and slow drifts of an uncalibrated model do not speak about wiring: compare changes from the first sample
    error = [(run[name] - run[name][0]) - (record[name] - record[name][0]) for name in sensors]
    return float(np.sqrt(np.mean(np.square(error))))
