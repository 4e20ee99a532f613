"""Outer loops in discrete time: what a controller sees, and what it must be able to do."""

from __future__ import annotations

from abc import ABC, abstractmethod
from pathlib import Path

from ..errors import InputError
from ._controller_input import ControllerInput as ControllerInput
from ._export_controller import export
from ._modules import Array


class Controller(ABC):
    """An outer loop: heats v from its inputs; its state is one vector, advanced with the heat *achieved*."""

    sample_time: float  # [s]

    @abstractmethod
    def start(self, given: ControllerInput, heat: Array) -> Array:
        """State from which the output stays at `heat` while the reference is the temperature.

        Parameters
        ----------
        given : ControllerInput
            Set-points and measured or estimated temperatures of this sample.
        heat : ndarray
            Heat in force at the start [W].
        """

    @abstractmethod
    def heat(self, state: Array, given: ControllerInput) -> Array:
        """Wanted heats v [W].

        Parameters
        ----------
        state : ndarray
            Memory of the controller.
        given : ControllerInput
            Set-points and measured or estimated temperatures of this sample.
        """

    @abstractmethod
    def advance(self, state: Array, given: ControllerInput, wanted: Array, achieved: Array) -> Array:
        """State at the next sample; wanted and achieved heats differ while a limit is active.

        Parameters
        ----------
        state : ndarray
            Memory of the controller.
        given : ControllerInput
            Set-points and measured or estimated temperatures of this sample.
        wanted : ndarray
            Heat that was asked for [W].
        achieved : ndarray
            Heat the modules give within their limits [W].
        """

    def export(self, path: str | Path, name: str = "controller") -> None:
        """Write the controller for another program: C99 (.c, .h), MATLAB (.mat) or JSON (.json).

        All hold the same three matrices: start, heat and advance are linear in the memory and in its inputs. C gets
        a state struct and three functions in double, with a test vector; JSON is read back by `load_controller`.

        Parameters
        ----------
        path : str or path
            File to write, replaced in one step; its ending says which.
        name : str
            Name of the design; in C the prefix of every identifier.

        Raises
        ------
        InputError
            For another ending, a controller that is not linear, or when the file cannot be written.
        """
        export(self, path, name)


def expect_modules(count: int, heat: Array) -> None:
    """Refuse a loop with another number of modules: one gain would silently act for all."""
    if len(heat) != count:
        raise InputError(f"a controller of {count} modules for a feedback law of {len(heat)}",
                         where="argument controller", expected="one made for the cold side of the same law",
                         remedy="rt.design.cold_side(law).")


def expect_controller(controller: object) -> None:
    """Refuse what cannot control."""
    missing = [name for name in ("sample_time", "start", "heat", "advance") if not hasattr(controller, name)]
    if missing:
        raise InputError(f"controller, a {type(controller).__name__}, has no {missing[0]}", where="argument controller",
                         expected="a controller", remedy="Make one with rt.design.pid, state_feedback or "
                         "linear_controller.")
