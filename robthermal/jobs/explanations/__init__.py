"""What a name means: an effect, a kind of certificate, the code of an outcome, a word of a report.

What asks every package (`collected`, `outcome_codes`, `package_of`) loads on first use (PEP 562): `explain` reads a
file.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from ._explain import KNOWN as KNOWN
from ._explain import explain as explain
from ._explain import explainable as explainable
from ._explanation import Explanation as Explanation
from ._glossary import GLOSSARY as GLOSSARY

if TYPE_CHECKING:  # what type checkers and editors see of the table below
    from ._codes import outcome_codes as outcome_codes
    from ._codes import package_of as package_of
    from ._sources import collected as collected

__all__ = ["Explanation", "GLOSSARY", "KNOWN", "collected", "explain", "explainable", "outcome_codes", "package_of"]

_HOME = {"collected": "_sources", "outcome_codes": "_codes", "package_of": "_codes"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_HOME[name]}", __name__), name)


def __dir__() -> list[str]:
    return __all__
