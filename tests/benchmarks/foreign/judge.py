"""One data set through the workflow, and what its answer is worth: the first accepted effect is the dominant one."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

import robthermal as rt

from .cases import STRENGTH, Case, made
from .machines import MACHINES
from .peers import SCALES, choices

Row = dict[str, Any]
NAMED = ("named", "named_with_remainder", "ambiguous")


def judged(case: Case, compare: bool = False) -> Row:
    """Make the data, diagnose, and keep what the tables need; with the choices of the peers if asked for."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        one = made(case)
        peers = {"peers": choices(one.system, one.train)} if compare and case.group == "hidden" else {}
        start = time.process_time()
        try:
            found = rt.diagnose(one.system, one.train, validation=one.unseen)
        except Exception as error:  # a crash is a result of the suite, with its message
            return {"key": case.key, "group": case.group, "strength": one.strength, "truth": [], "names": [],
                    "others": [], "verdict": "crashed", "text": f"{type(error).__name__}: {error}",
                    "seconds": time.process_time() - start}
    answer = found.to_dict()
    return {"key": case.key, "group": case.group, "strength": one.strength, "discrete": one.discrete,
            "coarse": one.coarse, "truth": [[name, list(where)] for name, where, _ in one.truth],
            "names": [[e["effect"], e["where"]] for e in answer["effects"]],
            "others": [[[o["effect"], o["where"]] for o in others] for others in answer["alternatives"]],
            "provisional": [[e["effect"], e["where"]] for e in answer["provisional"]],
            "sizes": sizes(answer["effects"], one.truth),
            "verdict": found.verdict, "gap": answer["gap"], "remainder": answer.get("remainder"),
            "text": found.outcome.text, "seconds": time.process_time() - start, **peers}


def sizes(effects: list[dict[str, Any]], truth: list[tuple[str, tuple[str, ...], float]]) -> list[dict[str, float]]:
    """Of right names: what was found, its stated standard deviation, and what is true; first quantity."""
    out = []
    for one in effects:
        for name, where, size in truth:
            if same([one["effect"], one["where"]], [name, list(where)]):
                first = next(iter(one["parameters"].values()))
                out.append({"found": first["value"], "std": first["std"], "true": size})
    return out


def within(row: Row) -> bool:
    """Whether the effect is as strong, and the network as coarse, as the suite asks for."""
    return row["group"] != "hidden" or row["strength"] >= 0.8 * STRENGTH[0]


def same(a: list[Any], b: list[Any]) -> bool:
    """The same effect at the same place."""
    return bool(a[0] == b[0] and sorted(a[1]) == sorted(b[1]))


def answer(row: Row) -> str:
    """unique, in the set, WRONG, set without, refused, or crashed."""
    if row["verdict"] == "crashed":
        return "crashed"
    if row["verdict"] not in NAMED:
        return "refused"
    sets = [[name, *others] for name, others in zip(row["names"], row["others"], strict=True)]
    holds = [any(same(name, true) for name in names for true in row["truth"]) for names in sets]
    if any(len(names) == 1 and not right for names, right in zip(sets, holds, strict=True)):
        return "WRONG"
    if not all(holds):
        return "set without"
    return "unique" if all(len(names) == 1 for names in sets) else "in the set"


def one_path(row: Row) -> bool:
    """Whether every set is the truth, with at most the same heat path from and to neighboring lumps: one answer.

    Or a mass on a lump and one within a path that leads from it.
    """
    if answer(row) not in ("unique", "in the set"):
        return False
    joined = neighbors(row["key"].split("/")[0])

    def near(one: list[str], other: list[str]) -> bool:
        return len(one) == len(other) == 2 and any(
            all(p == q or frozenset((p, q)) in joined for p, q in zip(one, ends, strict=True))
            for ends in (other, other[::-1]))

    def one_mass(one: list[Any], other: list[Any]) -> bool:
        at, path = sorted((one, other))
        return (at[0], path[0]) == ("hidden_mass", "path_mass") and at[1][0] in path[1][0].split("-")

    return all((other[0] == name[0] and near(name[1], other[1])) or one_mass(name, other)
               for name, others in zip(row["names"], row["others"], strict=True) for other in others)


@cache
def neighbors(machine: str) -> set[frozenset[str]]:
    """Pairs of lumps that the user's network joins."""
    system = MACHINES[machine](np.random.default_rng(0)).network(0.01, np.random.default_rng(0))
    return {frozenset(link.between) for link in system.links}


def rate(rows: list[Row], hit: Callable[[Row], bool]) -> str:
    """Share with Wilson's 95 % interval, and the counts."""
    k, n = sum(map(hit, rows)), len(rows)
    if not rows:
        return "none"
    low, high = wilson(k, n)
    return f"{100 * k / n:5.1f} % [{100 * low:.1f}, {100 * high:.1f}]  {k} of {n}"


def wilson(k: int, n: int, z: float = 1.959964) -> tuple[float, float]:
    """Wilson's interval of a share (1927)."""
    middle, width = k + z**2 / 2.0, z * (k * (n - k) / n + z**2 / 4.0) ** 0.5
    return max(0.0, (middle - width) / (n + z**2)), min(1.0, (middle + width) / (n + z**2))


def print_tables(rows: list[Row]) -> None:
    """What the contract asks for."""
    hidden = [row for row in rows if row["group"] == "hidden" and within(row)]
    null, outside = ([row for row in rows if row["group"] == group] for group in ("nothing", "outside"))
    print(f"hidden effect: named uniquely, nothing else   {rate(hidden, lambda r: answer(r) == 'unique')}  aim >= 85 %")
    print(f"  unique, or one path at neighboring lumps    {rate(hidden, one_path)}")
    print(f"  unique or in a set                          "
          f"{rate(hidden, lambda r: answer(r) in ('unique', 'in the set'))}")
    print(f"  refused                                     {rate(hidden, lambda r: answer(r) == 'refused')}")
    print(f"  a wrong unique name                         {rate(hidden, lambda r: answer(r) == 'WRONG')}  aim <= 3 %")
    print(f"discretization only: a name                   {rate(null, lambda r: r['verdict'] in NAMED)}  aim <= 5 %")
    print(f"outside the catalog: refused                  "
          f"{rate(outside, lambda r: answer(r) == 'refused')}  aim >= 90 %")
    stated = [row for row in hidden if answer(row) == "unique" and row["remainder"]]
    print(f"remainder within a factor 2 of the truth      "
          f"{rate(stated, lambda r: 0.5 <= r['remainder']['train']['rms'] / r['coarse'] <= 2.0)}")
    print_sizes([one for row in hidden for one in row.get("sizes", []) if row["remainder"]])
    seconds = sorted(row["seconds"] for row in rows)
    print(f"CPU seconds: median {seconds[len(seconds) // 2]:.1f}, worst {seconds[-1]:.1f}")
    print_peers([row for row in hidden if "peers" in row])
    for row in rows:
        if answer(row) not in ("unique", "refused") or (row["group"] == "hidden" and answer(row) == "refused"):
            names = "; ".join(" or ".join(f"{n}({', '.join(w)})" for n, w in [one, *others])
                              for one, others in zip(row["names"], row["others"], strict=True))
            names = names or row["text"][:90]
            print(f"  {row['key']}: {answer(row)}, {row['verdict']}, strength {row['strength']:.1f}: {names}")


def print_sizes(found: list[dict[str, float]]) -> None:
    """How far sizes are from the truth, by the deviations stated with them: 95 % should be within 1.96."""
    if not found:
        return
    far = np.array([abs(one["found"] - one["true"]) / one["std"] for one in found])
    off = np.array([abs(one["found"] / one["true"] - 1.0) for one in found])
    wide = np.array([one["std"] / abs(one["true"]) for one in found])
    print(f"size within 1.96 stated deviations of the truth {100 * np.mean(far <= 1.96):.0f} % of {far.size}, within 3 "
          f"{100 * np.mean(far <= 3.0):.0f} %; median off by {100 * np.median(off):.1f} %, stated "
          f"{100 * np.median(wide):.1f} %")


def print_peers(rows: list[Row]) -> None:
    """How often the peers' choice is the truth: the best correlation; the only name that nothing falsifies."""
    def right(row: Row, name: Any) -> bool:
        return name is not None and any(same(name, true) for true in row["truth"])

    if not rows:
        return
    print(f"residual correlation: first guess right       {rate(rows, lambda r: right(r, r['peers']['correlation']))}")
    print(f"best score: right                             {rate(rows, lambda r: right(r, r['peers']['best score']))}")
    for c in map(str, SCALES):
        left = {row["key"]: row["peers"]["discrepancy"][c] for row in rows}
        alone = [row for row in rows if len(left[row["key"]]) == 1 and left[row["key"]][0] is not None]
        good = sum(right(row, left[row["key"]][0]) for row in alone)
        held = sum(any(right(row, name) for name in left[row["key"]]) for row in rows)
        print(f"empirical discrepancy, c = {float(c):<8.3g} unique {good} of {len(rows)}, unique and wrong "
              f"{len(alone) - good}, truth among what is left {held}")
