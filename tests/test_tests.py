"""Every test asserts, whichever way it runs: what a test must look like, found in its syntax tree."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeGuard

import pytest

HERE = Path(__file__).resolve().parent
FILES = sorted(path for path in HERE.rglob("*.py") if "benchmarks" not in path.parts)
TREES = {path: ast.parse(path.read_text(encoding="utf-8")) for path in FILES}
# Calls that fail by themselves; numpy.testing's are all named assert_...
FAILING = {"raises", "warns", "fail"}
# Calls whose result is as long as what they are given, or as their number says.
AS_LONG = {"enumerate", "zip", "sorted", "reversed", "list", "tuple", "set", "items", "values", "keys", "linspace",
           "arange", "product"}


def is_function(node: ast.AST) -> TypeGuard[ast.FunctionDef]:
    return isinstance(node, ast.FunctionDef)


def called(node: ast.AST) -> str:
    """Last part of the name that is called; empty for anything else."""
    function = node.func if isinstance(node, ast.Call) else None
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")


def checks(node: ast.AST, helpers: set[str]) -> bool:
    """Whether an expression calls something that fails when its claim does not hold."""
    calls = [one for one in ast.walk(node) if isinstance(one, ast.Call)]
    return any(name.startswith("assert_") or name in FAILING or name in helpers for name in map(called, calls)) or any(
        ast.unparse(keyword) == "check=True" for one in calls for keyword in one.keywords)  # a process


def never_empty(iterable: ast.expr, known: set[str]) -> bool:
    """Whether one sees that a loop over this runs: written out here, or a constant, or a fixed number of times."""
    match iterable:
        case ast.Tuple() | ast.List() | ast.Set() | ast.Dict():
            return any(True for _ in ast.iter_child_nodes(iterable))
        case ast.Constant():
            return bool(iterable.value)
        case ast.Name() | ast.Attribute():
            name = ast.unparse(iterable)
            return name in known or name.split(".")[-1].isupper()
        case ast.Call(args=[*_, last]) if called(iterable) == "range":
            return never_empty(last, known)
        case ast.Call() if called(iterable) in AS_LONG:
            of = iterable.args or ([iterable.func.value] if isinstance(iterable.func, ast.Attribute) else [])
            strict = any(ast.unparse(keyword) == "strict=True" for keyword in iterable.keywords)
            seen = [never_empty(one, known) for one in of]
            return any(seen) if strict else bool(seen) and all(seen)
    return False


def leaves(node: ast.AST) -> bool:
    """Whether a statement may end the test or a round of its loop (functions defined inside are another matter)."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return False
    return isinstance(node, ast.Return | ast.Continue | ast.Break) or any(map(leaves, ast.iter_child_nodes(node)))


@dataclass(frozen=True)
class Reader:
    """What is known while a test is read: functions that assert, names that stand for something written out."""

    helpers: set[str]
    known: set[str]

    def always(self, statements: Sequence[ast.stmt]) -> bool:
        """Whether something is asserted before these statements can be left."""
        for node in statements:
            if self.asserts(node):
                return True
            if self.leaves_unchecked(node):
                return False
        return False

    def leaves_unchecked(self, node: ast.stmt) -> bool:
        if isinstance(node, ast.If):
            branches = [node.body, node.orelse]
        elif isinstance(node, ast.Try):
            branches = [node.body, *(handler.body for handler in node.handlers)]
        else:
            return not isinstance(node, ast.For | ast.While) and leaves(node)
        return any(any(map(leaves, branch)) and not self.always(branch) for branch in branches)

    def asserts(self, node: ast.stmt) -> bool:
        """Whether a statement asserts whichever of its branches is taken, and however often a loop runs."""
        match node:
            case ast.Assert():
                return True
            case ast.If():
                return self.always(node.body) and self.always(node.orelse)
            case ast.For():
                return never_empty(node.iter, self.known) and self.always(node.body)
            case ast.With():
                return any(checks(item, self.helpers) for item in node.items) or self.always(node.body)
            case ast.Try():
                return (self.always([*node.body, *node.orelse]) and all(self.always(one.body) for one in node.handlers)
                        or self.always(node.finalbody))
            case ast.Match():
                return all(self.always(case.body) for case in node.cases)
            case ast.FunctionDef() | ast.ClassDef() | ast.While():
                return False
        return checks(node, self.helpers)


def written_out(test: ast.FunctionDef) -> set[str]:
    """Names that a test gives to something written out."""
    pairs = [(node.targets[0], node.value) for node in ast.walk(test) if isinstance(node, ast.Assign)]
    pairs += [(one, value) for target, of in pairs if isinstance(target, ast.Tuple) and isinstance(of, ast.Tuple)
              for one, value in zip(target.elts, of.elts, strict=False)]
    return {target.id for target, value in pairs if isinstance(target, ast.Name)
            and isinstance(value, ast.Tuple | ast.List | ast.Dict | ast.Set) and never_empty(value, set())}


def imported(tree: ast.Module) -> set[str]:
    """Names of modules, and what is imported from them."""
    return {name for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)
            for name in (getattr(node, "module", None) or "", *(alias.name for alias in node.names))}


def helpers_of(path: Path) -> set[str]:
    """Functions that assert and that the tests of a file can call: its own, of its folders, of modules beside it."""
    tree = TREES[path]
    modules = imported(tree)
    near = [other for other in FILES if other == path or other.stem in modules
            or other.name == "conftest.py" and other.parent in path.parents]
    functions = [node for other in near for node in ast.walk(TREES[other])
                 if is_function(node) and not node.name.startswith("test_")]
    found: set[str] = set()
    while True:
        more = {f.name for f in functions if f.name not in found and (
            any(isinstance(node, ast.Assert) for node in ast.walk(f)) or checks(f, found))}
        if not more:
            return found
        found |= more


def functions_named_test(tree: ast.Module) -> Iterator[ast.FunctionDef]:
    return (node for node in ast.walk(tree) if is_function(node) and node.name.startswith("test_"))


def may_pass_without_a_check(tree: ast.Module, helpers: set[str]) -> list[str]:
    return [f"line {test.lineno}: {test.name}" for test in functions_named_test(tree)
            if not Reader(helpers, written_out(test)).always(test.body)]


def test_no_test_imports_a_test() -> None:
    """pytest loads its files by path; a second copy under a name of the same spelling in another folder is not it."""
    assert [f"{path.relative_to(HERE)}: {name}" for path, tree in TREES.items() for name in imported(tree)
            if name.startswith("test_")] == []


def test_modules_that_tests_share_have_names_of_their_own() -> None:
    shared = [path.stem for path in FILES if path.name != "conftest.py" and not path.name.startswith("test_")]
    shared += [path.stem for path in (HERE / "benchmarks").glob("*.py")]
    assert shared and len(shared) == len(set(shared))


BAD = {
    "nothing": "x = 1",
    "under_a_condition": "if holds():\n    assert x",
    "after_return": "if x:\n    return\nassert x",
    "after_continue": "for x in (1, 2):\n    if x:\n        continue\n    assert x",
    "over_nothing": "for x in found():\n    assert x",
    "never_called": "def inner():\n    assert x",
    "swallowed": "try:\n    assert x\nexcept AssertionError:\n    pass",
    "while_it_holds": "while holds():\n    assert x",
}
GOOD = {
    "both_branches": "if x:\n    assert x\n    return\nassert y",
    "written_out": "cases = {1: 2}\nfor x in cases.items():\n    assert x",
    "counted": "found = all_of()\nassert found\nfor x in found:\n    assert x",
    "raised": "with pytest.raises(InputError):\n    f()",
    "numpy": "np.testing.assert_allclose(a, b)",
    "by_helper": "same(a, b)",
    "process": "subprocess.run(words, check=True)",
    "cleaned_up": "try:\n    assert x\nfinally:\n    f()",
    "as_long": "for a, b in zip(found(), (1, 2), strict=True):\n    assert a == b",
}


def one_test(body: str) -> ast.Module:
    return ast.parse("def test_it():\n    " + body.replace("\n", "\n    "))


@pytest.mark.parametrize("kind", BAD)
def test_a_test_that_may_pass_without_a_check_is_found(kind: str) -> None:
    assert may_pass_without_a_check(one_test(BAD[kind]), set()) == ["line 1: test_it"]


@pytest.mark.parametrize("kind", GOOD)
def test_a_test_that_always_checks_is_left_alone(kind: str) -> None:
    assert may_pass_without_a_check(one_test(GOOD[kind]), {"same"}) == []


@pytest.mark.parametrize("path", [path for path in FILES if path.name.startswith("test_")],
                         ids=lambda path: str(path.relative_to(HERE)))
def test_every_test_asserts(path: Path) -> None:
    assert may_pass_without_a_check(TREES[path], helpers_of(path)) == [], (
        "no assertion, or only inside `if`, after `return` or `continue`, or in a loop that may run over nothing: "
        "assert what is always true as well (how many cases there were)")
