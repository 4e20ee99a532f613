"""Embedded systems and sourced parameter sets."""

from ._datasheets import datasheets as datasheets
from ._embedded import tclab as tclab
from ._embedded import tclab_two_state as tclab_two_state
from ._embedded import two_module as two_module
from ._ferrotec import ferrotec as ferrotec
from ._ferrotec import surrogate_module as surrogate_module
from ._scanner import Scanner as Scanner
from ._scanner import scanner as scanner

__all__ = ["Scanner", "datasheets", "ferrotec", "scanner", "surrogate_module", "tclab", "tclab_two_state", "two_module"]
