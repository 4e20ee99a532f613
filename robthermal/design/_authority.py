"""Currents that a linearizing feedback law may take from a certificate or from a usable current."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..certify import UsableCurrent, check_certificate
from ..errors import InputError
from ..verification import Certificate
from ._error_box import check_box
from ._modules import Array, ModuleSet

_WHERE = "argument certificate"


def proven_currents(modules: ModuleSet, authority: Certificate | UsableCurrent) -> tuple[Array, Array]:
    """Return the current box of a proven certificate of this system, (n_modules,) each [A].

    Of a contraction certificate with a warning: it does not say that the temperatures stay where it holds.
    """
    if isinstance(authority, UsableCurrent):
        return _usable(modules, authority)
    check_certificate(authority, modules.system, "contraction")
    check_box(modules.system, authority.region["current"], authority.region["temperature"], _WHERE)
    warnings.warn("the currents of the feedback law are a contraction limit inside the box; not a limit for use: the "
                  "certificate does not say that temperatures stay in its box. Pass what rt.certify.usable_current "
                  "returns.", UserWarning, stacklevel=3)
    return _ends(modules, authority.region["current"])


def _usable(modules: ModuleSet, usable: UsableCurrent) -> tuple[Array, Array]:
    if not usable.holds:
        raise InputError(f"no current is usable: {usable.outcome}", where=_WHERE, expected="one above zero")
    low, high = _ends(modules, usable.range)
    for kind, certificate in (("contraction", usable.contraction), ("invariance", usable.invariance)):
        check_certificate(certificate, modules.system, kind, f"{_WHERE}.{kind}")
        own_low, own_high = _ends(modules, certificate.region["current"])
        if (low < own_low).any() or (high > own_high).any():
            raise InputError("the range exceeds the currents of its certificate", where=f"{_WHERE}.{kind}",
                             expected="what rt.certify.usable_current returned")
    return low, high


def _ends(modules: ModuleSet, current: Mapping[str, Any]) -> tuple[Array, Array]:
    pairs = np.array([[float(value) for value in current[name]] for name in modules.names])
    return pairs[:, 0], pairs[:, 1]
