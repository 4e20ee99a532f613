"""The rates of the suite with their counts and intervals, and the confusion matrix."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from scipy.stats import beta

from .judge import (
    Row,
    all_named,
    answer,
    covered,
    detected,
    excess,
    has_truth,
    near_aliases,
    own_top_one,
    ratio,
    sets,
    strength,
    top_one,
    true_names,
    unique,
    wrong,
)

COLUMNS = ("unique", "in the set", "one of two", "unexplained", "not detected", "set without", "WRONG", "crashed")
NAMES, QUIET = ("named", "ambiguous"), ("unexplained", "consistent")


def interval(k: int, n: int) -> tuple[float, float]:
    """Clopper and Pearson's 95 % interval."""
    low = float(beta.ppf(0.025, k, n - k + 1)) if k else 0.0
    return low, float(beta.ppf(0.975, k + 1, n - k)) if k < n else 1.0


def print_rate(what: str, wanted: str, rows: Iterable[Row], hit: Callable[[Row], Any]) -> None:
    """One line: rate, counts, interval, and what the aim is."""
    rows = list(rows)
    k, n = sum(bool(hit(row)) for row in rows), len(rows)
    if n == 0:
        print(f"{what:<72} none")
        return
    low, high = interval(k, n)
    print(f"{what:<72} {100 * k / n:6.1f} %  {k:4d} of {n:<4d} [{100 * low:.1f}, {100 * high:.1f}]  aim {wanted}")


def print_rates(rows: list[Row]) -> None:
    """Everything the issue asks for."""
    groups = {name: [row for row in rows if row["group"] == name]
              for name in ("hidden", "nothing", "noise", "outside", "two")}
    hidden = [row for row in groups["hidden"] if row["verdict"] != "crashed"]
    said = [row for row in hidden if row["verdict"] in NAMES]
    only = [row for row in said if any(unique(row, names) for names in sets(row))]
    seen = [row for row in hidden if detected(row)]
    print_rate("crashed, all groups", "0", rows, lambda r: r["verdict"] == "crashed")
    print("\none hidden effect")
    print_rate("wrong among unique names", "<= 2 %", only, wrong)
    print_rate("truth in the returned set", ">= 97 %", said, has_truth)
    print_rate("  the same, 'unexplained' counted as a miss", "", seen, has_truth)
    print_rate("unique, ΔBIC > 300", ">= 92 %", (r for r in seen if strength(r) > 300), all_named)
    print_rate("  unique, or in a set of near aliases of one family", "", (r for r in seen if strength(r) > 300),
               near_aliases)
    print_rate("  of the others: the same inputs once more would add less than ΔBIC 10", "",
               (r for r in seen if strength(r) > 300 and not all_named(r) and "expected" in r.get("follow", {})),
               lambda r: r["follow"]["present"] < 10)
    print_rate("unique, ΔBIC 50 to 300", ">= 60 %", (r for r in seen if 50 < strength(r) <= 300), all_named)
    for low, high, aim in ((0, 0.7, ""), (0.7, 1.3, ""), (1.3, np.inf, ">= 90 %"), (3.0, np.inf, "")):
        print_rate(f"detected at {low} to {high} times the declared limit", aim,
                   (r for r in hidden if ratio(r) is not None and low <= ratio(r) < high), detected)
    right = [row for row in hidden if row["verdict"] == "named" and all_named(row)]
    print_rate("95 % interval of the size holds the truth", "90-98 %", right, covered)
    print_excess(said)
    print("\nnothing hidden, or something else")
    print_rate("names, nothing hidden", "<= 1 %", groups["nothing"], lambda r: r["verdict"] in NAMES)
    print_rate("'unexplained', nothing hidden", "", groups["nothing"], lambda r: r["verdict"] == "unexplained")
    print_rate("names, noise other than declared", "<= 2 %", groups["noise"], lambda r: r["verdict"] in NAMES)
    print_rate("'unexplained', noise other than declared", "<= 20 %", groups["noise"],
               lambda r: r["verdict"] == "unexplained")
    print_rate("outside the catalog: no name", ">= 95 %", groups["outside"], lambda r: r["verdict"] in QUIET)
    print_rate("  the same, of those detected", "", filter(detected, groups["outside"]),
               lambda r: r["verdict"] in QUIET)
    print("\ntwo hidden effects")
    print_rate("both named, nothing else", ">= 60 %", groups["two"], all_named)
    print_rate("both in the sets", "", groups["two"], has_truth)
    print_rate("a wrong unique name", "<= 3 %", groups["two"], wrong)
    print("\nnext experiment")
    print_follow([row for row in rows if "follow" in row])
    print("\npeers: first guess right, on the same data")
    both = [row for row in hidden if "peers" in row]
    print_rate("robthermal", "", both, own_top_one)
    print_rate("residual correlation", "", both, lambda r: top_one(r, "correlation"))
    print_rate("regression on derivatives (SINDy-style)", "", both, lambda r: top_one(r, "regression"))
    print_rate("  the same, of what its library holds", "", (r for r in both if r["peers"]["expressible"]),
               lambda r: top_one(r, "regression"))
    print_rate("regression: exactly the hidden term", "", both,
               lambda r: len(r["peers"]["regression"]) == 1 and top_one(r, "regression"))
    quiet = [row for row in groups["nothing"] if "peers" in row]
    print_rate("regression: names something, nothing hidden", "", quiet, lambda r: r["peers"]["regression"])
    print_times(rows)


def print_excess(rows: list[Row]) -> None:
    """Excess variance on validation records."""
    ratios = [value for row in rows if (value := excess(row)) is not None]
    if ratios:
        print(f"{'excess variance of validation records, after over before':<72} median {np.median(ratios):.3f}, 90 % "
              f"{np.quantile(ratios, 0.9):.3f}, worst {max(ratios):.3f} of {len(ratios)}  aim <= 0.05, worst <= 0.3")


def print_follow(rows: list[Row]) -> None:
    """Ambiguous answers after the recommended experiment."""
    one = [row for row in rows if row["group"] == "hidden" and not all_named(row)]  # exact aliases count as unique

    def after(row: Row) -> Row:
        return {**row, "names": [], "others": [], **row["follow"]}

    print_rate("ambiguous, then uniquely right after one recommended experiment", ">= 70 %", one,
               lambda r: all_named(after(r)))
    print_rate("  of those with an expected ΔBIC above 20", "", (r for r in one if r["follow"].get("expected", 0) > 20),
               lambda r: all_named(after(r)))
    print_rate("  a wrong unique name then", "", one, lambda r: wrong(after(r)))


def print_times(rows: list[Row]) -> None:
    """CPU seconds per data set."""
    print("\nCPU seconds a data set (one core)")
    for name in sorted({row["topology"] for row in rows}):
        own = [row for row in rows if row["topology"] == name]
        seconds = np.array([row["seconds"] for row in own])
        count = max(row.get("candidates", 0) for row in own)
        slowest = own[int(np.argmax(seconds))]["key"]
        print(f"{name}: median {np.median(seconds):.1f}, 90 % {np.quantile(seconds, 0.9):.1f}, worst "
              f"{seconds.max():.1f} ({slowest}), {count} candidates, aim <= 10")


def print_matrix(rows: list[Row]) -> None:
    """Rows: what was hidden; columns: what was said; then what the sets held beside the truth."""
    print(f"\n{'':<34}" + "".join(f"{column:>13}" for column in COLUMNS) + "  in sets with")
    lines = sorted({(row["topology"], row["group"], row["effect"]) for row in rows},
                   key=lambda key: (key[1] != "hidden", key[1], key[0], key[2]))
    for topology, group, effect in lines:
        own = [r for r in rows if (r["topology"], r["group"], r["effect"]) == (topology, group, effect)]
        counts = Counter(map(answer, own))
        beside = Counter(f"{name}({', '.join(where)})" for row in own for names in sets(row) if len(names) > 1
                         for name, where in names if [name, where] not in true_names(row))
        text = ", ".join(f"{label} {count}" for label, count in beside.most_common(3))
        print(f"{topology + ' ' + effect:<34}" + "".join(f"{counts[column] or '.':>13}" for column in COLUMNS)
              + "  " + text)
    print("\nwrong names and crashes:")
    for row in rows:
        if answer(row) in ("WRONG", "crashed", "set without"):
            names = "; ".join(" or ".join(f"{n}({', '.join(w)})" for n, w in names) for names in sets(row))
            print(f"  {row['key']}: {names or row.get('error')}, size/limit {ratio(row) or float('nan'):.2g}, "
                  f"ΔBIC {strength(row):.0f}")
