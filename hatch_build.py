"""Compile the kernels in C beside their sources where there is a C compiler; without one nothing is lost.

The package computes the same with numpy, slower. Whatever goes wrong here is one line of note and a pure package.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

KERNELS = {  # sources, each with the headers that belong to it
    Path("robthermal", "identify", "_moments.c"): ("_vectors.h", "../_lanes.h"),
    Path("robthermal", "_recursion.c"): ("_lanes.h",),
    Path("robthermal", "thermal", "_march.c"): ("../_lanes.h",),
    Path("robthermal", "diagnosis", "path", "_filter.c"): ("../../_lanes.h",),
}
# Not -march=native: what is built on one computer runs on another; the library says which of its parts the processor
# has instructions for. -O2 with peeled loops is as fast as -O3 and takes 10 s instead of 24. Not -ffast-math: numbers
# that are not numbers must stay so.
FLAGS = ("-std=c11", "-O2", "-fpeel-loops", "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math",
         "-Wno-psabi", "-fPIC")
X86 = {  # by the width of a vector; the first has to succeed
    4: ("-mavx2", "-mfma"),
    8: ("-mavx512f", "-mavx512dq", "-mavx512vl", "-mfma", "-mprefer-vector-width=512"),
    2: (),  # any processor
}
ARM: dict[int, tuple[str, ...]] = {2: ()}  # every 64-bit one has vectors of two
PARTS = {"x86_64": X86, "amd64": X86, "aarch64": ARM, "arm64": ARM}
LONGEST = 300  # seconds that the compiler may take: 10 where nothing else runs


class KernelHook(BuildHookInterface):  # type: ignore[type-arg]
    """Adds the library to a wheel, or puts it into the tree of an editable install."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called before a wheel is put together; `version` is "standard" or "editable"."""
        if self.target_name != "wheel":
            return
        if version != "editable":
            self._folder = Path(tempfile.mkdtemp())
        for kernel, headers in KERNELS.items():
            try:
                library = self._built(Path(self.root, kernel), headers)
            except (OSError, RuntimeError, subprocess.SubprocessError) as error:
                print(f"note: robthermal without its compiled kernel {kernel.stem} ({error}); numpy does the same, "
                      "slower", file=sys.stderr)
                continue
            if version != "editable":
                build_data["force_include"][str(library)] = str(kernel.with_name(library.name))
                build_data["pure_python"] = False
                build_data["tag"] = f"py3-none-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"

    def _built(self, source: Path, headers: tuple[str, ...]) -> Path:
        """The library of a source: in a folder of its own, or beside the source, where it replaces older ones."""
        text = b"".join(path.read_bytes() for path in (source, *(source.parent / name for name in headers)))
        name = f"{source.stem}_{hashlib.sha256(text).hexdigest()[:16]}.so"  # as the package looks for it
        library = getattr(self, "_folder", source.parent) / name
        build(source, library)
        if library.parent == source.parent:
            for old in source.parent.glob(f"{source.stem}_*.so"):
                if old.name != name:
                    old.unlink(missing_ok=True)
        return library

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Called when the wheel is written."""
        if version != "editable" and hasattr(self, "_folder"):
            shutil.rmtree(self._folder, ignore_errors=True)


def build(source: Path, library: Path) -> None:
    """Compile `source` to `library`, which appears whole or not at all."""
    parts = PARTS.get(platform.machine().lower())
    if parts is X86 and '#include "_vectors.h"' in source.read_text():
        parts = {lanes: flags for lanes, flags in X86.items() if flags}  # 10 s each: numpy does for old processors
    if sys.platform == "win32" or not parts:
        raise RuntimeError(f"it is for x86-64 and ARM64, not Windows; this is {sys.platform} on {platform.machine()}")
    compiler = shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc")
    if not compiler or not shutil.which(compiler[0]):
        compiler = ["cc"]
    unfinished = library.with_suffix(f".{os.getpid()}.tmp")
    with tempfile.TemporaryDirectory() as folder:
        objects = [Path(folder, f"{lanes}.o") for lanes in parts]
        with ThreadPoolExecutor() as pool:
            failed = [*pool.map(lambda lanes, target: _run([*compiler, *FLAGS, *parts[lanes], f"-DLANES={lanes}", "-c",
                                                            "-o", str(target), str(source)]), parts, objects)]
        if failed[0]:
            raise RuntimeError(failed[0])
        whole = [str(target) for target, message in zip(objects, failed, strict=True) if not message]
        try:
            if message := _run([*compiler, "-shared", "-o", str(unfinished), *whole]):
                raise RuntimeError(message)
            unfinished.replace(library)
        finally:
            unfinished.unlink(missing_ok=True)


def _run(command: list[str]) -> str:
    """What a command of the compiler complains about; empty where it succeeded."""
    run = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST, check=False)
    first = (run.stderr.strip().splitlines() or ["failed"])[0][:200]
    return f"{command[0]}: {first}" if run.returncode else ""
