"""Where a report comes from: versions, hashes of input files, what the machine consists of."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import takewhile
from pathlib import Path

from ..report import file_hash, versions
from ..thermal import System

_HEAD = 8192  # bytes in which a comment is looked for


def provenance(files: tuple[Path, ...]) -> Mapping[str, str]:
    """Versions, and the SHA-256 of every input file by its name."""
    return {**versions(), **{f"SHA-256 of {file.name}": file_hash(file) for file in files}}


def subtitle(system: System, title: str = "") -> str:
    """What a machine consists of, after its name where the title of the page does not hold it.

    Parameters
    ----------
    system : System
        Machine of the report.
    title : str, optional
        Title above it.
    """
    heaters = sum(one.gain != 0.0 for one in system.inputs.values())
    counts = {"lump": len(system.lumps), "module": len(system.modules), "heater": heaters,
              "recorded column": len(system.inputs) - heaters, "sensor": len(system.sensors)}
    parts = ", ".join(f"{n} {what}{'s' * (n > 1)}" for what, n in counts.items() if n)
    return parts if system.name in title else f"{system.name}: {parts}"


def simulated_label(names: Iterable[str], files: Iterable[Path] = ()) -> str:
    """Banner of a report whose system, records or files are called simulated, or say so; empty for any other.

    Parameters
    ----------
    names : iterable of str
        What the system, its records and the files are called.
    files : iterable of Path, optional
        Measured files. A comment before the header of a text file that begins with "simulated" says that it is.

    Examples
    --------
    >>> simulated_label(["plate", "simulated.csv"]), simulated_label(["plate", "friday.csv"])
    ('SIMULATED DATA: simulated.csv', '')
    """
    said = [name for name in names if "simulated" in name.lower()]
    said += [file.name for file in files if _says_simulated(file)]
    return f"SIMULATED DATA: {', '.join(dict.fromkeys(said))}" if said else ""


def _says_simulated(file: Path) -> bool:
    """Whether a comment in the head of a text file begins with the word."""
    if file.suffix.lower() == ".toml" or not file.is_file():
        return False
    with file.open("rb") as stream:
        head = stream.read(_HEAD)
    lines = [line.strip() for line in head.decode("latin-1").splitlines()]
    comments = takewhile(lambda line: not line or line.startswith("#"), lines)
    return any(line.strip("#;,\"' \t").lower().startswith("simulated") for line in comments)
