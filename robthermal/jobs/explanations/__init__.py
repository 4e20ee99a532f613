"""What a name means: an effect, a kind of certificate, the code of an outcome, a word of a report."""

from ._codes import outcome_codes as outcome_codes
from ._codes import package_of as package_of
from ._explain import Explanation as Explanation
from ._explain import explain as explain
from ._explain import explainable as explainable
from ._glossary import GLOSSARY as GLOSSARY

__all__ = ["Explanation", "GLOSSARY", "explain", "explainable", "outcome_codes", "package_of"]
