"""The kernel in C: the same as the one in numpy, never called with sizes that do not fit, never an old library."""

from __future__ import annotations

import ctypes
import platform
import shutil
from pathlib import Path
from typing import Any

import compiled
import numpy as np
import pytest

from robthermal._library import LANES, library_name
from robthermal.identify import _compiled
from robthermal.identify._basis import LocalBasis
from robthermal.identify._compiled import CompiledKernel, interior_kernel, library
from robthermal.identify._kernel import BlockFit
from robthermal.identify._normal import NormalKernel
from robthermal.identify._records import Spectrum

CASES = [  # n_u, n_y, records, half_width, degree, poles, all noise covariances
    (1, 1, 1, 8, 2, (), True), (2, 2, 1, 8, 2, (), True), (1, 1, 2, 8, 3, (-0.01, -0.1, -0.5), True),
    (2, 3, 1, 9, 2, (), False), (3, 1, 2, 9, 1, (), True), (1, 2, 1, 3, 0, (), False),
    (2, 2, 2, 8, 2, (-0.02 + 0.3j, -0.02 - 0.3j), False), (1, 1, 1, 12, 4, (), True), (3, 3, 1, 14, 3, (), True)]


def spectra_of(n_u: int, n_y: int, n_r: int, n_bins: int = 1500, seed: int = 0) -> list[Spectrum]:
    """White inputs, a smooth response, 5 % noise."""
    rng, found = np.random.default_rng(seed), []
    G = 1.0 / (1.0 + 3j * np.linspace(0.0, 1.0, n_bins)) * rng.uniform(0.5, 1.5, (n_y, n_u, 1))
    for _ in range(n_r):
        U, V = (rng.normal(size=(2, n, n_bins)) for n in (n_u, n_y))
        U, V = U[0] + 1j * U[1], V[0] + 1j * V[1]
        found.append(Spectrum(U=U, Y=np.einsum("oif,if->of", G, U) + 0.05 * V, n_samples=2 * n_bins + 1))
    return found


def basis_of(half_width: int, degree: int, poles: tuple[complex, ...], n_bins: int = 1500) -> LocalBasis:
    return LocalBasis(half_width, degree, 2 * n_bins + 1, poles=np.array(poles, dtype=complex))


@pytest.fixture(params=[None, 4])
def built(request: pytest.FixtureRequest) -> _compiled.Solver:
    """The part of the library that this processor takes, and the lesser one of x86-64."""
    return compiled.built(request.param)


@pytest.mark.parametrize(("n_u", "n_y", "n_r", "half_width", "degree", "poles", "full"), CASES)
def test_the_same_as_numpy(n_u: int, n_y: int, n_r: int, half_width: int, degree: int, poles: Any, full: bool,
                           built: _compiled.Solver) -> None:
    """All windows between the edges, and parts of them that are no multiple of anything."""
    spectra, basis = spectra_of(n_u, n_y, n_r), basis_of(half_width, degree, poles)
    here, numpy = CompiledKernel(spectra, basis, built), NormalKernel(spectra, basis)
    assert here.degrees_of_freedom == numpy.degrees_of_freedom
    for start, stop in ((half_width + 1, 1501 - half_width), (700, 701), (90, 95), (41, 41 + 257)):
        mine, theirs = (kernel.solve(start, stop, full_noise=full) for kernel in (here, numpy))
        np.testing.assert_array_equal(mine.doubtful, theirs.doubtful)
        assert not mine.doubtful.all()
        for name in ("response", "gram", "noise"):
            a, b = (getattr(fit, name)[..., ~mine.doubtful] for fit in (mine, theirs))
            assert a.shape == b.shape and a.dtype == b.dtype
            np.testing.assert_allclose(a, b, rtol=1e-7, atol=1e-7 * np.abs(b).max(), err_msg=name)


def test_a_bin_has_the_same_digits_wherever_its_part_begins(built: _compiled.Solver) -> None:
    spectra, basis = spectra_of(2, 2, 1), basis_of(8, 2, ())
    kernel = CompiledKernel(spectra, basis, built)
    whole, part = kernel.solve(9, 1493, full_noise=True), kernel.solve(400, 777, full_noise=True)
    for name in ("response", "gram", "noise", "doubtful"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[..., 391:768])


@pytest.mark.parametrize("channel", ["U", "Y"])
def test_silence_is_as_doubtful_as_in_numpy(channel: str, built: _compiled.Solver) -> None:
    spectra, basis = spectra_of(1, 1, 1), basis_of(8, 2, ())
    getattr(spectra[0], channel)[:, 300:340] = 0.0
    mine, theirs = (kernel.solve(9, 1493, full_noise=True).doubtful
                    for kernel in (CompiledKernel(spectra, basis, built), NormalKernel(spectra, basis)))
    np.testing.assert_array_equal(mine, theirs)
    assert mine[300:324].all() and not mine[:280].any() and not mine[345:].any()


@pytest.mark.parametrize(("value", "channel"), [(np.nan, "U"), (np.nan, "Y"), (np.inf, "Y"), (np.inf, "U")])
def test_windows_that_reach_what_is_no_number_are_doubtful(value: float, channel: str, built: _compiled.Solver) -> None:
    """Window i is centered at place i + 8 and reaches eight places to either side."""
    spectra, basis = spectra_of(1, 1, 1), basis_of(8, 2, ())
    getattr(spectra[0], channel)[:, 300:340] = value
    fit = CompiledKernel(spectra, basis, built).solve(9, 1493, full_noise=True)
    np.testing.assert_array_equal(np.flatnonzero(fit.doubtful), np.arange(284, 340))


def test_wrong_sizes_are_exceptions(built: _compiled.Solver) -> None:
    spectra, basis = spectra_of(1, 1, 1), basis_of(8, 2, ())
    kernel = CompiledKernel(spectra, basis, built)
    for start, stop in ((8, 100), (9, 1494), (100, 100), (200, 100), (-5, 3)):
        with pytest.raises(ValueError, match="reach beyond"):
            kernel.solve(start, stop, full_noise=True)
    short = Spectrum(U=spectra[0].U, Y=spectra[0].Y[:, :-1], n_samples=3001)
    longer = spectra_of(1, 1, 1, n_bins=1400)
    for wrong in ([short], [*spectra, *longer], [*spectra, *spectra_of(2, 1, 1)]):
        with pytest.raises(ValueError, match="an array of shape"):
            CompiledKernel(wrong, basis, built)
    with pytest.raises(ValueError, match="more functions or columns"):
        CompiledKernel(spectra, basis_of(14, 5, ()), built)


def places(n_u: int, n_y: int, count: int, full: bool) -> dict[str, Any]:
    """Arrays for the results of more bins than are asked for, filled with not-a-number."""
    noise = np.full((n_y, n_y, count) if full else (n_y, count), np.nan, dtype=complex if full else float)
    return {"response": np.full((n_y, n_u, count), np.nan, dtype=complex), "noise": noise,
            "gram": np.full((n_u, n_u, count), np.nan, dtype=complex), "doubtful": np.ones(count, dtype=bool),
            "variance": np.full((n_y, count), np.nan)}


@pytest.mark.parametrize("full", [True, False])
@pytest.mark.parametrize("count", [1, 3, 700])
def test_results_are_written_where_they_belong(full: bool, count: int, built: _compiled.Solver) -> None:
    """And nowhere else."""
    spectra, basis = spectra_of(2, 3, 1), basis_of(9, 2, ())
    kernel = CompiledKernel(spectra, basis, built)
    there, apart = places(2, 3, 1000, full), kernel.solve(50, 50 + count, full_noise=full)
    part = BlockFit(**{name: values[..., 200 : 200 + count] for name, values in there.items()})
    assert kernel.solve(50, 50 + count, full_noise=full, into=part) is part
    for name in ("response", "gram", "noise", "doubtful"):
        np.testing.assert_array_equal(getattr(part, name), getattr(apart, name))
        outside = np.delete(there[name], np.s_[200 : 200 + count], axis=-1)
        assert outside.all() if name == "doubtful" else np.isnan(outside).all()
    if full:
        np.testing.assert_array_equal(part.variance, np.einsum("oob->ob", part.noise).real)


@pytest.mark.parametrize("name", ["response", "gram", "noise", "doubtful", "variance"])
def test_results_that_would_be_written_elsewhere_are_exceptions(name: str, built: _compiled.Solver) -> None:
    kernel = CompiledKernel(spectra_of(2, 3, 1), basis_of(9, 2, ()), built)
    good = places(2, 3, 100, True)
    locked = good[name].copy()
    locked.flags.writeable = False
    for wrong in (good[name][..., :99], np.repeat(good[name], 2, axis=-1)[..., ::2], good[name].astype(np.complex64),
                  locked):
        with pytest.raises(ValueError, match="do not lie where"):
            kernel.solve(50, 150, full_noise=True, into=BlockFit(**{**good, name: wrong}))


def test_arrays_that_do_not_lie_in_a_row_are_copied(built: _compiled.Solver) -> None:
    (one,), basis = spectra_of(2, 1, 1), basis_of(8, 2, ())
    other = Spectrum(U=np.asfortranarray(one.U), Y=np.repeat(one.Y, 2, axis=1)[:, ::2], n_samples=one.n_samples)
    a, b = (CompiledKernel([s], basis, built).solve(9, 1493, full_noise=True) for s in (one, other))
    np.testing.assert_array_equal(a.response, b.response)


def test_numpy_takes_what_the_library_does_not_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    built = compiled.built()
    for answer, degree, kind in ((built, 2, CompiledKernel), (built, 5, NormalKernel), (None, 2, NormalKernel)):
        monkeypatch.setattr(_compiled, "library", lambda answer=answer: answer)
        assert type(interior_kernel(spectra_of(1, 1, 1), basis_of(14, degree, ()))) is kind
    monkeypatch.setattr(_compiled, "library", lambda: built)
    monkeypatch.setattr(LocalBasis, "real_functions", lambda basis: np.ones((3, 29)))  # the second is not odd
    assert type(interior_kernel(spectra_of(1, 1, 1), basis_of(14, 2, ()))) is NormalKernel


def test_a_library_of_another_source_is_not_loaded(tmp_path: Path) -> None:
    name, other = compiled.name_of(_compiled), compiled.copied(_compiled, tmp_path / "tree", new=" ")
    wrong = library_name(other, _compiled.HEADERS)
    assert name != wrong
    (tmp_path / wrong).write_bytes(b"")
    assert library(tmp_path) is None
    (tmp_path / "damaged").mkdir()
    (tmp_path / "damaged" / name).write_bytes(b"no library")
    assert library(tmp_path / "damaged") is None


def test_the_widest_part_that_runs_is_taken(built: _compiled.Solver) -> None:
    """By name, for a pointer to a function does not say whose it is; None for a width that was not compiled."""
    folder = compiled.folder()
    widest = next(lanes for lanes in LANES if library(folder, lanes) is not None)
    assert library(folder).__name__ == f"robthermal_solve_{widest}"
    assert library(folder, 3) is None and built.__name__.startswith("robthermal_solve_")


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A source tree with an old library in it."""
    compiled.copied(_compiled, tmp_path).with_name("_moments_0123456789abcdef.so").write_bytes(b"old")
    return tmp_path


@pytest.mark.parametrize("version", ["standard", "editable"])
def test_without_a_compiler_the_package_is_pure(tree: Path, version: str, monkeypatch: pytest.MonkeyPatch,
                                                capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv("PATH", str(tree))
    monkeypatch.setenv("CC", "no-such-compiler")
    assert compiled.built_by_hook(tree, version) == {"force_include": {}}
    assert "numpy does the same, slower" in capsys.readouterr().err


def test_a_compiler_that_fails_is_a_note(tree: Path, monkeypatch: pytest.MonkeyPatch,
                                         capsys: pytest.CaptureFixture[str]) -> None:
    (tree / "robthermal" / "identify" / "_moments.c").write_text("#error not today\n")
    monkeypatch.delenv("CC", raising=False)
    assert compiled.built_by_hook(tree, "editable") == {"force_include": {}}
    assert "note: robthermal without its compiled kernel" in capsys.readouterr().err
    assert [path.name for path in (tree / "robthermal" / "identify").glob("*.so")] == ["_moments_0123456789abcdef.so"]


def test_the_source_distribution_has_no_library(tree: Path) -> None:
    assert compiled.built_by_hook(tree, "standard", "sdist") == {"force_include": {}}


PARTS = "#define JOINED(lanes) robthermal_runs_here_##lanes\n#define NAMED(lanes) JOINED(lanes)\n"
PARTS += "int NAMED(LANES)(void) { return LANES; }\n"


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_an_editable_install_replaces_the_old_library(tree: Path) -> None:
    source = tree / "robthermal" / "identify" / "_moments.c"
    source.write_text(PARTS)
    name = library_name(source, _compiled.HEADERS)
    assert compiled.built_by_hook(tree, "editable") == {"force_include": {}}
    assert [path.name for path in source.parent.glob("*.so")] == [name]
    wheel = compiled.built_by_hook(tree, "standard")
    (there,) = wheel["force_include"].values()
    assert there == f"robthermal/identify/{name}" and wheel["pure_python"] is False
    assert wheel["tag"].startswith("py3-none-")


def parts_of(path: Path) -> set[int]:
    """Widths of the vectors of a library; none of the old one, which is text."""
    if path.read_bytes() == b"old":
        return set()
    found = ctypes.CDLL(str(path))
    return {lanes for lanes in LANES if hasattr(found, f"robthermal_runs_here_{lanes}")}


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize(("machine", "parts"), [
    ("AMD64", {2, 4, 8}), ("arm64", {2}), ("aarch64", {2}), ("mips", set())])
def test_the_parts_are_those_of_the_machine(tree: Path, machine: str, parts: set[int],
                                            monkeypatch: pytest.MonkeyPatch) -> None:
    if machine == "AMD64" and platform.machine().lower() not in ("x86_64", "amd64"):
        pytest.skip("this compiler knows no AVX")
    (tree / "robthermal" / "identify" / "_moments.c").write_text(PARTS)
    monkeypatch.setattr(platform, "machine", lambda: machine)
    compiled.built_by_hook(tree, "editable")
    (path,) = (tree / "robthermal" / "identify").glob("*.so")
    assert parts_of(path) == parts


@pytest.mark.skipif(shutil.which("cc") is None or platform.machine().lower() not in ("x86_64", "amd64"),
                    reason="no C compiler, or one that knows no AVX")
@pytest.mark.parametrize(("missing", "parts"), [(8, {2, 4}), (4, set()), (0, {2, 4, 8})])
def test_a_compiler_without_avx512_builds_the_other_parts(tree: Path, missing: int, parts: set[int]) -> None:
    source = tree / "robthermal" / "identify" / "_moments.c"
    source.write_text(f"#if LANES == {missing}\n#error no such instructions\n#endif\n{PARTS}")
    compiled.built_by_hook(tree, "editable")
    (path,) = source.parent.glob("*.so")
    assert parts_of(path) == parts
