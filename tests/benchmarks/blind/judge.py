"""What an answer is worth: right, one of a set, nothing, or wrong."""

from __future__ import annotations

from typing import Any

from .plants import PLANTS

Row = dict[str, Any]
VISIBLE = 1.3  # whitened variance of validation records from which a gap can be seen to close


def same(a: list[Any], b: list[Any]) -> bool:
    """The same effect at the same place; the order of two lumps does not matter."""
    return a[0] == b[0] and (a[1] == b[1] or (len(a[1]) == 2 and sorted(a[1]) == sorted(b[1])))


def exact_alias(topology: str, a: list[Any], b: list[Any]) -> bool:
    """Constant heat, ambient gradient, self-heating and heater offset at one lump: the contract's exact aliases."""
    lump = _constant_heat(topology, a)
    return lump is not None and lump == _constant_heat(topology, b)


FAMILIES = (  # near aliases that the contract and its notes list, at the same or a neighboring place
    {"input_lag", "input_delay", "sensor_lag"}, {"joule_split", "lead_heating"}, {"sensor_gain"},
    {"missing_ambient_link", "radiation", "natural_convection", "condensation"})


def near_aliases(row: Row) -> bool:
    """Whether every hidden effect is in a set that holds nothing but near aliases of one family."""
    return has_truth(row) and all(any({name[0] for name in names} <= family for family in FAMILIES)
                                  or unique(row, names) for names in sets(row))


def _constant_heat(topology: str, name: list[Any]) -> str | None:
    """Lump that gets a constant heat from this effect, if it is one."""
    plant, (effect, where) = PLANTS[topology](), name
    if effect in ("heat_source", "ambient_gradient"):
        return str(where[0])
    if effect == "sensor_self_heating":
        return plant.sensors[where[0]]
    if effect == "input_offset" and where[0] in plant.heaters:
        return plant.heaters[where[0]][0]
    return None


def sets(row: Row) -> list[list[list[Any]]]:
    """Set of names per accepted effect, the preferred one first."""
    return [[name, *others] for name, others in zip(row.get("names", []), row.get("others", []), strict=True)]


def unique(row: Row, names: list[list[Any]]) -> bool:
    """One name, or nothing beside it but its exact aliases."""
    return all(exact_alias(row["topology"], names[0], other) for other in names[1:])


def true_names(row: Row) -> list[list[Any]]:
    """What was hidden."""
    return [[name, where] for name, where, _ in row["truth"]]


def wrong(row: Row) -> bool:
    """Whether any unique name is not (or is more than) what was hidden."""
    return any(unique(row, names) and stray({**row, "names": names[:1], "others": [names[1:]]}) for names in sets(row))


def stray(row: Row) -> bool:
    """Whether any returned set, unique or not, holds nothing that was hidden."""
    return any(not any(same(name, true) for name in names for true in true_names(row)) for names in sets(row))


def has_truth(row: Row) -> bool:
    """Whether every hidden effect is in a set of its own."""
    left = sets(row)
    for true in true_names(row):
        holding = [names for names in left if any(same(name, true) for name in names)]
        if not holding:
            return False
        left.remove(min(holding, key=len))
    return True


def all_named(row: Row) -> bool:
    """Whether every hidden effect was named uniquely, and nothing else."""
    return has_truth(row) and all(unique(row, names) for names in sets(row)) and len(sets(row)) == len(row["truth"])


def detected(row: Row) -> bool:
    """Anything but "consistent"."""
    return row["verdict"] != "consistent"


def answer(row: Row) -> str:
    """Column of the confusion matrix."""
    if row["verdict"] == "crashed":
        return "crashed"
    if row["verdict"] == "consistent":
        return "not detected"
    if row["verdict"] == "unexplained":
        return "unexplained"
    if wrong(row):
        return "WRONG"
    if stray(row):
        return "set without"
    if all_named(row):
        return "unique"
    return "in the set" if has_truth(row) else "one of two"


def strength(row: Row) -> float:
    """ΔBIC of the first accepted effect."""
    return row["delta_bic"][0] if row.get("delta_bic") else 0.0


def ratio(row: Row) -> float | None:
    """Size of the hidden effect in units of its declared detection limit; none without a finite limit."""
    if not row.get("limits") or row["limits"][0] is None:
        return None
    return abs(next(iter(row["truth"][0][2].values()))) / row["limits"][0]


def excess(row: Row) -> float | None:
    """Excess whitened variance of validation records after over before, where it could be seen."""
    before, after = row.get("validation", (0.0, 0.0))
    return (after - 1.0) / (before - 1.0) if before > VISIBLE else None


def covered(row: Row) -> bool:
    """Whether value ± 1.96 standard deviations of a right unique name holds the true size."""
    value, std = row["sizes"][0]
    return bool(abs(value - next(iter(row["truth"][0][2].values()))) <= 1.96 * std)


def top_one(row: Row, peer: str) -> bool:
    """Whether a peer's first guess is the truth."""
    guess = row["peers"][peer]
    first = guess[0] if peer == "regression" and guess else guess
    return bool(first) and same(first, true_names(row)[0])


def own_top_one(row: Row) -> bool:
    """Whether the first name, provisional ones included, is the truth."""
    first = (row.get("names") or row.get("provisional") or [None])[0]
    return first is not None and same(first, true_names(row)[0])
