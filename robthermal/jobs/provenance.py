"""Where a report comes from: versions, hashes of input files, what the machine consists of."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..report import file_hash, versions
from ..thermal import System


def provenance(files: tuple[Path, ...]) -> Mapping[str, str]:
    """Versions, and the SHA-256 of every input file by its name."""
    return {**versions(), **{f"SHA-256 of {file.name}": file_hash(file) for file in files}}


def subtitle(system: System) -> str:
    """What a machine consists of."""
    counts = {"lump": len(system.lumps), "module": len(system.modules), "heater": len(system.inputs),
              "sensor": len(system.sensors)}
    return f"{system.name}: " + ", ".join(f"{n} {what}{'s' * (n > 1)}" for what, n in counts.items() if n)
