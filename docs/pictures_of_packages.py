"""Draw docs/images/packages.svg, the packages and who imports whom: python docs/pictures_of_packages.py"""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "robthermal"
PICTURE = ROOT / "docs" / "images" / "packages.svg"
# Text stays text, and the same picture is the same file.
STYLE = {"svg.fonttype": "none", "svg.hashsalt": "robthermal", "font.size": 9}
LEFT_OUT = {"project", "errors"}  # the former name of another package, and what every package imports
WIDTH, HEIGHT, ROW = 1.9, 0.5, 1.0  # of a place, of a box, and the distance of rows, in the picture's units


def layers() -> list[list[str]]:
    """Public packages, highest first, as the import contract in pyproject.toml orders them."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    rows = next(one["layers"] for one in settings["contracts"] if one["containers"] == ["robthermal"])
    named = [re.findall(r"\w+", row) for row in rows]
    found = [[name for name in row if not name.startswith("_") and name not in LEFT_OUT] for row in named]
    return [row for row in found if row]


def imported(path: Path) -> Iterator[str]:
    """Packages of robthermal that a file imports while it runs, itself included."""
    here = list(path.relative_to(ROOT).with_suffix("").parts)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            base = here[:len(here) - node.level] if node.level else []
            target = base + (node.module.split(".") if node.module else [])
            names = [target[1]] if len(target) > 1 else [alias.name for alias in node.names]
            if target[:1] == ["robthermal"]:
                yield from names
        elif isinstance(node, ast.Import):
            yield from (alias.name.split(".")[1] for alias in node.names if alias.name.startswith("robthermal."))
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "rt":
            yield node.attr  # `import robthermal as rt` loads a package when it is named


def imports() -> dict[str, set[str]]:
    """What every public package imports from the other public packages."""
    names = [name for row in layers() for name in row]
    files = {name: [*(SOURCE / name).rglob("*.py"), *SOURCE.glob(f"{name}.py")] for name in names}
    return {name: {to for path in files[name] for to in imported(path)} & set(names) - {name} for name in names}


def arrows(uses: dict[str, set[str]]) -> list[tuple[str, str]]:
    """Imports without those that another package already brings along."""
    reached: dict[str, set[str]] = {}
    for name in (name for row in reversed(layers()) for name in row):
        reached[name] = uses[name].union(*(reached[to] for to in uses[name]))
    return [(name, to) for name, targets in uses.items() for to in sorted(targets)
            if not any(to in reached[other] for other in targets - {to})]


def description() -> str:
    """The arrows in words; the picture carries them, and a test compares."""
    return "; ".join(f"{name} imports {to}" for name, to in arrows(imports()))


def draw(path: Path) -> Path:
    """Write the picture."""
    rows = layers()
    wide = max(map(len, rows)) * WIDTH
    aside = [0.3 * (level % 2) for level in range(len(rows))]  # so that arrows between far rows miss the boxes
    places = {name: (wide * (k + 1) / (len(row) + 1) + aside[level], -ROW * level) for level, row in enumerate(rows)
              for k, name in enumerate(row)}
    with rc_context(STYLE):
        figure = Figure(figsize=(0.75 * wide, 0.62 * ROW * len(rows)), layout="constrained")
        axes = figure.subplots()
        for name, to in arrows(imports()):
            (x, y), (x_to, y_to) = places[name], places[to]
            axes.annotate("", (x_to, y_to + HEIGHT / 2), (x, y - HEIGHT / 2),
                          arrowprops={"arrowstyle": "-|>", "color": "0.6", "linewidth": 0.8})
        for name, (x, y) in places.items():
            axes.text(x, y, name, ha="center", va="center",
                      bbox={"boxstyle": "round,pad=0.4", "facecolor": "white", "edgecolor": "0.2", "linewidth": 0.8})
        axes.set(xlim=(0, wide), ylim=(-ROW * (len(rows) - 0.5), 0.5 * ROW))
        axes.axis("off")
        figure.savefig(path, metadata={"Date": None, "Description": description()})
    return path


if __name__ == "__main__":
    print(f"{draw(PICTURE).name} {PICTURE.stat().st_size / 1000:.1f} kB")
