"""Tests that read the package: who imports whom, what is documented, what is public, what it depends on."""

from __future__ import annotations

import ast
import inspect
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from importlib import import_module, metadata
from pathlib import Path
from types import ModuleType

import grimp
import numpy as np
import pytest
from docutils.core import publish_doctree
from docutils.nodes import problematic
from importlinter import cli as import_linter
from numpydoc.docscrape import NumpyDocString
from packaging.requirements import Requirement
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

import robthermal as rt

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "robthermal"
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES = rt._PACKAGES
INSIDE = {"cli", "conic", "export", "fitting", "linear"}  # what other packages use, or the command line
FILES = sorted(PACKAGE.rglob("*.py"))
CONTRACTS = [contract["id"] for contract in PYPROJECT["tool"]["importlinter"]["contracts"]]


def relative(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


@cache
def import_graph() -> grimp.ImportGraph:
    return grimp.build_graph(
        "robthermal", include_external_packages=True, exclude_type_checking_imports=True, cache_dir=None
    )


# Who imports whom


@pytest.mark.parametrize("contract", CONTRACTS)
def test_import_contract(contract: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(ROOT)
    status = import_linter.lint_imports(
        config_filename=str(ROOT / "pyproject.toml"), limit_to_contracts=(contract,), no_cache=True
    )
    assert status == 0, capsys.readouterr().out


def test_no_import_cycles() -> None:
    graph = import_graph()
    uses = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    assert set(TopologicalSorter(uses).static_order()) >= set(graph.modules)  # a cycle raises and is named


def test_few_circles_are_closed_by_imports_for_type_checkers() -> None:
    """A class and what draws or writes it name one another; more than these, and the files are no longer apart."""
    graph = grimp.build_graph("robthermal", cache_dir=None)
    uses = {module: sorted(graph.find_modules_directly_imported_by(module)) for module in sorted(graph.modules)}
    names = list(uses)
    matrix = csr_array([[other in found for other in names] for found in map(set, uses.values())])
    _, label = connected_components(matrix, directed=True, connection="strong")
    circles = [[name for name, own in zip(names, label, strict=True) if own == one]
               for one, size in enumerate(np.bincount(label)) if size > 1]
    assert len(circles) <= 4, "\n".join(", ".join(circle) for circle in circles)


def test_no_package_goes_through_the_front_door() -> None:
    # `import robthermal` inside a package would let it reach every other package past the contract.
    guests = import_graph().find_modules_that_directly_import("robthermal")
    assert {one for one in guests if not one.startswith("robthermal.cli.")} <= {"robthermal.__main__"}


def test_checker_imports_only_what_its_proofs_need() -> None:
    graph = import_graph()
    trusted = {"robthermal.errors", "numpy", "flint"} | set(sys.stdlib_module_names)
    inside = {module for module in graph.modules if f"{module}.".startswith("robthermal.verification.")}
    assert inside
    foreign = {
        (module, imported)
        for module in inside
        for imported in graph.find_modules_directly_imported_by(module) - inside
        if imported not in trusted and imported.split(".")[0] not in trusted
    }
    assert not foreign


def test_importing_the_package_loads_no_heavy_dependency() -> None:
    heavy = {"numpy", "scipy", "pandas", "control", "matplotlib", "cvxpy", "clarabel", "flint", "pydantic", "jinja2"}
    code = "import sys, robthermal; print(*sorted({name.split('.')[0] for name in sys.modules}))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(run.stdout.split())
    assert "robthermal" in loaded
    assert not loaded & heavy


def imports_inside_functions(path: Path) -> Iterator[tuple[int, str]]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    functions = [node for node in ast.walk(tree) if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))]
    for node in {node for function in functions for node in ast.walk(function)}:
        if isinstance(node, ast.Import):
            yield node.lineno, node.names[0].name
        elif isinstance(node, ast.ImportFrom):
            yield node.lineno, "." * node.level + (node.module or "")


@pytest.mark.parametrize("path", FILES, ids=relative)
def test_imports_stand_at_the_top(path: Path) -> None:
    # Heavy and seldom needed: drawing, two optional file formats, package metadata. Nothing else may hide.
    may_wait = ("matplotlib", "nptdms", "pyarrow", "importlib.metadata")
    hidden = [(line, name) for line, name in imports_inside_functions(path) if not name.startswith(may_wait)]
    assert not hidden, f"{relative(path)}: imports inside functions at (line, module) {sorted(hidden)}"


_ON_FIRST_USE = ("control", "pandas", "matplotlib.pyplot", "scipy.signal", "scipy.stats", "scipy.optimize",
                 "scipy.interpolate", "scipy.ndimage", "scipy.io", "scipy.fft", "joblib")
_BEFORE_THE_FILES = ("signals", "thermal", "identify", "fitting", "calibration", "systems")  # loaded by every command
_EARLY = ("scipy.linalg", "scipy.sparse", "scipy.special")


def test_slow_libraries_are_imported_on_first_use() -> None:
    """`import scipy`, then `scipy.signal.lfilter(...)`, loaded when asked; `from .._control import control`, `pd`."""
    found = [f"{relative(path)}:{node.lineno} {name}" for path in FILES if path.name != "conftest.py"
             for node in ast.parse(path.read_text(encoding="utf-8")).body for name in _imported(node)
             for slow in (*_ON_FIRST_USE, *_EARLY * (relative(path).split("/")[1] in _BEFORE_THE_FILES))
             if f"{name}.".startswith(f"{slow}.")]
    assert not found


def test_no_command_waits_for_scipy_stats() -> None:
    """Half a second to import, for a few tails that `_distributions` has by scipy.special."""
    used = [relative(path) for path in FILES for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
            if isinstance(node, ast.Attribute) and ast.unparse(node) == "scipy.stats"]
    assert not used


def _imported(node: ast.stmt) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom) and not node.level:
        return [f"{node.module}.{alias.name}" for alias in node.names]
    return []


def test_imports_at_the_top_are_seen() -> None:
    code = "import control, scipy\nfrom scipy import stats\nfrom scipy.signal import lfilter\nfrom . import x"
    assert [name for node in ast.parse(code).body for name in _imported(node)] == [
        "control", "scipy", "scipy.stats", "scipy.signal.lfilter"]


@pytest.mark.parametrize("path", FILES, ids=relative)
def test_no_file_is_longer_than_400_lines(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 400


# What is public


def test_listed_packages_are_those_that_exist() -> None:
    packages = {path.name for path in PACKAGE.iterdir() if (path / "__init__.py").is_file()}
    assert packages >= INSIDE
    public = {name for name in packages - INSIDE if not name.startswith("_")} | {"errors"}
    assert set(PACKAGES) == public, "list the package in robthermal/__init__.py"
    pages = {path.stem for path in (ROOT / "docs" / "api").glob("*.md")} - {"index"}
    assert pages == public, "give the package a page in docs/api"


def test_every_top_level_name_loads_and_is_the_one_of_its_package() -> None:
    for name in rt.__all__:
        assert getattr(rt, name) is not None
    for name, package in rt._HOME.items():
        assert getattr(rt, name) is getattr(import_module(f"robthermal.{package}"), name)


def test_unknown_top_level_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = rt.nonsense


def test_type_checkers_see_the_lazy_names() -> None:
    assert _guarded(PACKAGE) == {**rt._HOME, **dict.fromkeys((*PACKAGES, *rt._FORMER))}
    assert _guarded(PACKAGE / "jobs") == {**rt.jobs._HOME, **dict.fromkeys(rt.jobs._PACKAGES)}


def _guarded(package: Path) -> dict[str, str | None]:
    """Names that a package imports for type checkers, with the package inside that each comes from."""
    tree = ast.parse((package / "__init__.py").read_text(encoding="utf-8"))
    guard = next(node for node in tree.body if isinstance(node, ast.If))
    seen: dict[str, str | None] = {}
    for node in guard.body:
        assert isinstance(node, ast.ImportFrom)
        seen |= {alias.name: node.module and node.module.split(".")[0] for alias in node.names}
    return seen


def test_every_job_loads_and_is_the_one_of_its_package() -> None:
    inside = {path.stem for path in (PACKAGE / "jobs").iterdir() if not path.name.startswith("_")}
    assert set(rt.jobs._PACKAGES) == inside
    for name in (*rt.jobs._PACKAGES, *rt.jobs.__all__):
        assert getattr(rt.jobs, name) is not None
    for name, package in rt.jobs._HOME.items():
        assert getattr(rt.jobs, name) is getattr(import_module(f"robthermal.jobs.{package}"), name)


@pytest.mark.parametrize("package", PACKAGES)
def test_package_has_an_export_list_and_no_name_of_another_library(package: str) -> None:
    module = import_module(f"robthermal.{package}")
    names = public_names(module)
    assert names
    for name in names:
        value = getattr(module, name)
        assert not inspect.ismodule(value), f"{package}.{name} is a module"
        assert getattr(value, "__module__", "robthermal").startswith("robthermal"), f"{package}.{name} is not ours"


def public_names(module: ModuleType) -> list[str]:
    if module.__name__ == "robthermal.errors":  # one file, no export list: everything it defines
        return [name for name, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__]
    names = list(module.__all__)
    assert names and len(names) == len(set(names))
    return names


# What is documented


def public_callables() -> Iterator[tuple[str, object]]:
    for package in PACKAGES:
        module = import_module(f"robthermal.{package}")
        for name in public_names(module):
            value = getattr(module, name)
            if not callable(value):
                continue
            yield f"{package}.{name}", value
            if inspect.isclass(value):
                for method, member in vars(value).items():
                    inner = member.__func__ if isinstance(member, (classmethod, staticmethod)) else member
                    if not method.startswith("_") and inspect.isfunction(inner):
                        yield f"{package}.{name}.{method}", inner


def described_parameters(value: object) -> set[str]:
    doc = NumpyDocString(inspect.getdoc(value) or "")
    entries = [*doc["Parameters"], *doc["Other Parameters"], *doc["Attributes"]]
    return {name.strip().lstrip("*") for entry in entries for name in entry.name.split(",")}


def undocumented(value: object) -> set[str]:
    if inspect.isclass(value) and issubclass(value, Exception) and value.__init__ is Exception.__init__:
        return set()
    parameters = inspect.signature(value).parameters  # type: ignore[arg-type]
    wanted = {name for name in parameters if name not in {"self", "cls"} and not name.startswith("_")}
    return wanted - described_parameters(value)


def is_enum_like(value: object) -> bool:
    return inspect.isclass(value) and hasattr(value, "__members__")


def test_every_public_callable_describes_every_parameter() -> None:
    missing = {}
    for name, value in public_callables():
        if not inspect.getdoc(value):
            missing[name] = "no docstring"
        elif not is_enum_like(value) and undocumented(value):
            missing[name] = f"parameters not described: {sorted(undocumented(value))}"
    assert not missing, "\n".join(f"{name}: {what}" for name, what in missing.items())


def test_every_public_function_has_an_example_that_runs() -> None:
    # Doctests are collected by pytest; here only that there is one. Methods are shown by the example of their class.
    top = [(name, value) for name, value in public_callables() if name.count(".") == 1 and inspect.isroutine(value)]
    assert top
    assert not [name for name, value in top if ">>>" not in (inspect.getdoc(value) or "")]


def badly_marked(text: str) -> list[str]:
    """What docutils takes for the name of a substitution in a docstring, such as |x| for an absolute value."""
    settings = {"report_level": 5, "halt_level": 5, "file_insertion_enabled": False}
    tree = publish_doctree(text, settings_overrides=settings)
    return [node.astext() for node in tree.findall(problematic) if node.astext().startswith("|")]


def test_no_docstring_refers_to_nothing() -> None:
    found = {name: badly_marked(inspect.getdoc(value) or "") for name, value in public_callables()}
    assert not {name: marked for name, marked in found.items() if marked}
    assert badly_marked("G (|x| / 10 K) x.") and not badly_marked("``G (|x| / 10 K)`` x.")


def exists(dotted: str) -> bool:
    """Whether ``rt.<dotted>`` is there."""
    value: object = rt
    for part in dotted.split("."):
        if not hasattr(value, part):
            return False
        value = getattr(value, part)
    return True


def test_a_name_that_does_not_exist_is_found() -> None:
    assert exists("certify.contraction") and not exists("certify.contracted") and not exists("nothing.contraction")


@pytest.mark.parametrize("page", [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))], ids=relative)
def test_names_in_the_text_exist(page: Path) -> None:
    mentioned = re.findall(r"\brt\.([A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*)", page.read_text(encoding="utf-8"))
    assert [dotted for dotted in sorted(set(mentioned)) if not exists(dotted)] == []


def test_one_version_everywhere() -> None:
    version = PYPROJECT["project"]["version"]
    assert re.search(rf"^version: {re.escape(version)}$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.M)
    assert f"\n## {version}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


# What it depends on


def installed_dependencies() -> dict[str, metadata.Distribution]:
    """Every distribution that `pip install robthermal` brings in, without extras."""
    found: dict[str, metadata.Distribution] = {}
    waiting = list(PYPROJECT["project"]["dependencies"])
    while waiting:
        requirement = Requirement(waiting.pop())
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": ""}):
            continue
        name = re.sub(r"[-_.]+", "-", requirement.name).lower()
        if name not in found:
            found[name] = metadata.distribution(name)
            waiting += found[name].requires or []
    return found


def licence_of(distribution: metadata.Distribution) -> str:
    """What a distribution says of its licence: expression and classifiers, else the first line of the text."""
    fields = distribution.metadata
    stated = [fields.get("License-Expression"), *(fields.get_all("Classifier") or [])]
    texts = [text for text in stated[:1] if text] + [text for text in stated[1:] if text.startswith("License ::")]
    return " ".join(texts) or (fields.get("License") or "").strip().split("\n")[0]


def test_solvers_that_nothing_calls_are_not_installed() -> None:
    """cvxpy brings six packages, 244 MB; only the formulations that the fast methods are compared with need it."""
    found = set(installed_dependencies())
    assert not found & {"cvxpy", "scs", "osqp", "highspy", "qdldl", "sparsediffpy"} and "clarabel" in found
    users = [str(path.relative_to(ROOT / "robthermal")) for path in (ROOT / "robthermal").rglob("*.py")
             if re.search(r"^\s*(import|from) cvxpy", path.read_text(encoding="utf-8"), re.M)]
    assert users == ["synthesis/_formulations.py"]


def test_no_dependency_is_gpl() -> None:
    licences = {name: licence_of(distribution) for name, distribution in installed_dependencies().items()}
    assert {"numpy", "clarabel", "python-flint"} <= set(licences)
    lesser = re.compile(r"LGPL|Lesser General Public", re.I)
    strong = re.compile(r"GPL|General Public License", re.I)
    assert not {name: text for name, text in licences.items() if strong.search(lesser.sub("", text))}
    assert not [name for name, text in licences.items() if not text], "no licence stated: look it up"
