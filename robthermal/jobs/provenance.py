"""Where a report comes from: versions, hashes of input files, what the machine consists of."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from ..report import file_hash, versions
from ..thermal import System


def provenance(files: tuple[Path, ...]) -> Mapping[str, str]:
    """Versions, and the SHA-256 of every input file by its name."""
    return {**versions(), **{f"SHA-256 of {file.name}": file_hash(file) for file in files}}


def subtitle(system: System, title: str = "") -> str:
    """What a machine consists of, after its name where the title of the page does not hold it.

    Parameters
    ----------
    system : System
        The machine.
    title : str, optional
        Title above it.
    """
    counts = {"lump": len(system.lumps), "module": len(system.modules), "heater": len(system.inputs),
              "sensor": len(system.sensors)}
    parts = ", ".join(f"{n} {what}{'s' * (n > 1)}" for what, n in counts.items() if n)
    return parts if system.name in title else f"{system.name}: {parts}"


def simulated_label(names: Iterable[str]) -> str:
    """Banner of a report whose system, records or files are called simulated; empty for any other.

    Parameters
    ----------
    names : iterable of str
        What the system, its records and the files are called.

    Examples
    --------
    >>> simulated_label(["plate", "simulated.csv"]), simulated_label(["plate", "friday.csv"])
    ('SIMULATED DATA: simulated.csv', '')
    """
    said = [name for name in dict.fromkeys(names) if "simulated" in name.lower()]
    return f"SIMULATED DATA: {', '.join(said)}" if said else ""
