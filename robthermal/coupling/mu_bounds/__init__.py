"""The structured singular value: of a matrix, and of a system over all frequencies. (`coupling.mu` is the function.)"""

from ._mu import mu as mu
from ._mu_bound import mu_bound as mu_bound
from ._result import MuBound as MuBound

__all__ = ["MuBound", "mu", "mu_bound"]
