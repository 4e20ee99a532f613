"""Modules that are imported when a name of them is first used: those that take longer than most commands need."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any


class OnFirstUse(ModuleType):
    """A module that becomes another one when it is asked for a name.

    Parameters
    ----------
    name : str
        Module to import.
    prepare : callable, optional
        Called with the module, before the name is returned.
    """

    def __init__(self, name: str, prepare: Callable[[ModuleType], None] | None = None):
        super().__init__(name)
        self._prepare = prepare

    def __getattr__(self, name: str) -> Any:
        module = import_module(self.__name__)
        if self._prepare:
            self._prepare(module)
        self.__dict__.update({key: value for key, value in vars(module).items() if not key.startswith("__")})
        return getattr(module, name)
