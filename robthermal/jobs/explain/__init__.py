"""What a name means: an effect, a kind of certificate, the code of an outcome."""

from ._explain import Explanation as Explanation
from ._explain import explain as explain
from ._explain import explainable as explainable

__all__ = ["Explanation", "explain", "explainable"]
