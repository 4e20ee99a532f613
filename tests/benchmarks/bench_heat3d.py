"""HEAT3D of the ARCH-COMP competition: proven bounds of the warmest moment in the middle of a cube, up to 10⁶ lumps.

python tests/benchmarks/bench_heat3d.py [N ...]; by default 5, 10, 20 and 50, n = 100 on request (a minute and a half).
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from pathlib import Path

import numpy as np
from _timing import header

sys.path.insert(0, str(Path(__file__).parents[1] / "verification"))
from heat3d import MAXIMA, heat3d  # noqa: E402  (the path is known now)

import robthermal as rt  # noqa: E402
from robthermal.verification import verify  # noqa: E402


def main(sizes: list[int]) -> None:
    """Print one row per size."""
    header("HEAT3D: largest temperature within 40 s")
    print("   n    published   proven below   within 1e-4   pieces   degree   found [cpu-s]   "
          "verified [cpu-s]   memory")
    for n in sizes:
        A, start, lump = heat3d(n)
        before = time.process_time()
        found = rt.certify.network_peak(np.ones(n**3), A, lump, start, 40.0)
        middle = time.process_time()
        valid = verify(found).valid
        after = time.process_time()
        bound, memory = found.region["bound"], resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        print(f"{n:>4}   {MAXIMA[n]:>10}   {bound if valid else 'not proven':>12}   {bound < MAXIMA[n] + 1e-4!s:>11}   "
              f"{len(found.evidence['edges']):>6}   {found.evidence['degree']:>6}   {middle - before:>13.1f}   "
              f"{after - middle:>16.1f}   {memory:.2f} GiB", flush=True)


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("sizes", nargs="*", type=int, default=[5, 10, 20, 50], metavar="N")
    main(options.parse_args().sizes)
