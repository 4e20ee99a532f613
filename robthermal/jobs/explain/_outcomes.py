"""Every code of an Outcome, with what is said beside it: read from the package itself, so that it cannot be stale."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[2]
Sides = Mapping[str, bool]  # source text of a test: whether it is true
_LEFT_OUT = "…"  # a number or name that is only known with the result


@dataclass(frozen=True)
class Said:
    """What one place of the package says with a code.

    Parameters
    ----------
    room : str
        Where, for example "certify".
    ok : bool or None
        Whether the answer is yes; None if it depends.
    text : str
        The remedy, … for what only the result knows; empty if all of it is computed.
    """

    room: str
    ok: bool | None
    text: str


@cache
def outcome_codes() -> dict[str, tuple[Said, ...]]:
    """Codes of all outcomes.

    Returns
    -------
    dict of str to tuple of Said
        In alphabetical order.
    """
    found: dict[str, dict[Said, None]] = {}
    for path in sorted(_PACKAGE.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        if "Outcome(" in source:
            room = path.relative_to(_PACKAGE).parts[0].removesuffix(".py")
            for code, said in _calls(ast.parse(source), room):
                found.setdefault(code, {})[said] = None
    return {code: tuple(found[code]) for code in sorted(found)}


def _calls(tree: ast.Module, room: str) -> Iterator[tuple[str, Said]]:
    for function in (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)):
        for call in (node for node in ast.walk(function) if isinstance(node, ast.Call)):
            if isinstance(call.func, ast.Name) and call.func.id == "Outcome" and len(call.args) == 3:
                ok, code, text = call.args
                for name, sides in _codes(code, {}):
                    yield name, Said(room, _truth(ok, sides), _words(text, function, sides).strip())


def _codes(node: ast.expr, sides: Sides) -> Iterator[tuple[str, Sides]]:
    """Codes an expression may have, each with the truth of the tests that lead to it."""
    if isinstance(node, ast.IfExp):  # "adequate" if ok else "inadequate"
        yield from _codes(node.body, {**sides, ast.unparse(node.test): True})
        yield from _codes(node.orelse, {**sides, ast.unparse(node.test): False})
    elif isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value, sides


def _truth(node: ast.expr, sides: Sides) -> bool | None:
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        return node.value
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        inner = _truth(node.operand, sides)
        return None if inner is None else not inner
    return sides.get(ast.unparse(node))


def _words(node: ast.expr, function: ast.FunctionDef, sides: Sides) -> str:
    """The literal words of an expression; of a local name, those it is given."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(str(part.value) if isinstance(part, ast.Constant) else _LEFT_OUT for part in node.values)
    if isinstance(node, ast.BinOp):
        return _words(node.left, function, sides) + _words(node.right, function, sides)
    if isinstance(node, ast.IfExp):
        truth = sides.get(ast.unparse(node.test))
        chosen = [node.body] * (truth is not False) + [node.orelse] * (truth is not True)
        return _either(_words(side, function, sides) for side in chosen)
    if isinstance(node, ast.Name):
        given = (one.value for one in ast.walk(function) if isinstance(one, ast.Assign)
                 and any(isinstance(target, ast.Name) and target.id == node.id for target in one.targets))
        return _either(_words(value, function, sides) for value in given)
    return ""


def _either(texts: Iterable[str]) -> str:
    found = [text for text in texts if text.strip()]
    return found[0] if len(found) == 1 else " / ".join(text.strip() for text in found)
