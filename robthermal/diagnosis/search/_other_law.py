"""Laws of the heat between two nodes, which an inexact model cannot distinguish.

Natural convection and radiation of one path differ little over tens of kelvins. Beside a finer network that leaves no
misfit the right one is found; where it leaves one, the other stands beside it. A simulated mirror in vacuum, whose
network has four lumps, had natural convection as a name of its own. So it is with a conductance that grows with its
temperature: beside it stands radiation between the same two nodes, and the reverse.
Radiation from end to end of a chain looks like two links of one material that conduct better when hot: these stand
beside it where they together do as much.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

from ...errors import Diverged, InputError
from ...thermal import System
from ..effects import Candidate, candidates
from ..fit import Refit, exact
from ._as_well import as_well, enough, from_alone, listed_keys, refitted
from ._decide import Accepted
from ._joint_sets import refit_set
from ._short_list import Entry

_EXPONENT = "conductance_exponent"
_LAWS = ("natural_convection", "radiation", _EXPONENT)  # of the heat between two nodes
_MISFIT = 2.0  # whitened variance from which the first two are not distinguished
_SIZE = 0.5  # exponent at which a fit of two begins: metals 0.3, gases 0.8, fibres above 1


def other_laws(round_: Accepted, fit: Refit, less: Refit, names: Sequence[str] | None) -> list[Entry]:
    """Other laws of the heat between the same two nodes, if they do nearly as much, refitted.

    Where the fit leaves no misfit even a small difference between the two is seen, and none is asked.

    Parameters
    ----------
    round_ : Accepted
        Accepted effect with its contenders.
    fit : Refit
        Fit with all accepted effects.
    less : Refit
        Fit with all but this one.
    names : sequence of str or None
        Effects that may be named; None for the whole catalog.
    """
    best, system = round_.best.candidate, less.structure.base
    if best.effect.name not in _LAWS:
        return []
    seen = _LAWS[:2] if fit.variance < _MISFIT else ()
    others = [law for law in _LAWS if law != best.effect.name and (names is None or law in names)
              and not {law, best.effect.name} <= {*seen}]
    if not others:
        return []
    known, nodes = listed_keys(round_, fit), _nodes(best, system)
    tried = [one for one in less.testable(candidates(system, others)) if one.key not in known]
    found = as_well(best, [one for one in tried if _nodes(one, system) == nodes], less)
    return found if found or best.effect.name != "radiation" else _along_a_chain(best, tried, less)


def _along_a_chain(best: Candidate, tried: Sequence[Candidate], less: Refit) -> list[Entry]:
    """Exponents of two links from end to end, each by itself, where together they do as much as radiation."""
    plain, system = exact(less), less.structure.base
    laws = {one.where[0]: one for one in tried if one.effect.name == _EXPONENT}
    found: dict[str, Entry] = {}
    for chain in _chains(_nodes(best, system), system):
        if not set(chain) <= set(laws):
            continue
        try:
            pair = refit_set(plain, tuple(laws[name] for name in chain), [_SIZE, _SIZE]).fit
        except (Diverged, InputError):  # the model runs away
            continue
        if pair.rss < enough(best, plain):
            found |= {name: entry for name in chain for entry in refitted(laws[name], plain)[:1]}
    return [entry for alone in found.values() for entry in from_alone(alone, less)]


def _chains(nodes: frozenset[str], system: System) -> Iterator[tuple[str, str]]:
    """Names of two links that lead from one of two nodes to the other, over a lump."""
    for one, other in combinations(system.links, 2):
        middle = set(one.between) & set(other.between)
        if len(middle) == 1 and middle <= set(system.lumps) and {*one.between, *other.between} - middle == nodes:
            yield one.name, other.name


def _nodes(candidate: Candidate, system: System) -> frozenset[str]:
    """The two nodes between which an effect acts, by themselves or by their link."""
    joined = (link.between for link in system.links if candidate.where == (link.name,))
    return frozenset(next(joined, candidate.where))
