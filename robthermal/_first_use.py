"""Modules, and names of a package, that are imported when they are first used: most commands need few of them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
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


def names_on_first_use(package: str, home: Mapping[str, str]) -> Callable[[str], Any]:
    """``__getattr__`` of a package whose names load the module they live in on first use (PEP 562).

    Parameters
    ----------
    package : str
        Its ``__name__``.
    home : mapping of str to str
        Name to module of the package.

    Examples
    --------
    >>> look_up = names_on_first_use("json", {"JSONDecoder": "decoder"})
    >>> look_up("JSONDecoder").__module__
    'json.decoder'
    >>> look_up("JSONReader")
    Traceback (most recent call last):
    ...
    AttributeError: module 'json' has no attribute 'JSONReader'
    """
    def look_up(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(f".{home[name]}", package), name)
        setattr(sys.modules[package], name, value)  # found without this function from now on
        return value

    return look_up
