"""How fast the checker is: 18 lumps with every method, a thousand lumps, and networks up to a million lumps."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import scipy.sparse as sparse
from _timing import best_of, header, row

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "verification"))
import certificate_truth as truth  # noqa: E402 - beside the tests, not on the path before

from robthermal.verification import establish, verify  # noqa: E402


def modules() -> None:
    """Random systems of 18 lumps and two modules, every method."""
    rng = np.random.default_rng(2)
    system = truth.random_system(rng, modules=2)
    names = [f"y{k}" for k in range(18 - len(system["lumps"]))]
    system["lumps"] |= {name: {"capacity": 5.0} for name in names}
    system["links"] += [{"between": [name, "x0"], "conductance": 0.5} for name in names]
    system["links"] += [{"between": [name, "room"], "conductance": 0.1} for name in names]
    region = truth.box(system, 1.0)
    for method in ("sum", "max", "energy", "lyapunov"):
        evidence = truth.evidence_for(method, system, region, 1e-4, rng)
        if method == "lyapunov":
            evidence["matrix"] = np.diag([lump["capacity"] for lump in system["lumps"].values()])
        certificate = establish("contraction", system=system, region=region, evidence=evidence, made_by={}, margin={})
        seconds, verdict = best_of(lambda certificate=certificate: verify(certificate))
        row(f"18 lumps, 2 modules, {method}", seconds, f"valid: {verdict.valid}")


def networks() -> None:
    """Square grids: the largest temperature decays; a rate 1 per mille too large is refused."""
    for n in (100, 300, 1000):
        line = sparse.diags_array([np.ones(n - 1), np.ones(n - 1)], offsets=[1, -1])
        A = sparse.kron(sparse.eye_array(n), line) + sparse.kron(line, sparse.eye_array(n))
        A = sparse.coo_array(A - sparse.diags_array(np.asarray(A.sum(axis=1)).ravel() + 0.01))
        system = {"capacity": np.ones(n * n), "rows": A.row, "cols": A.col, "values": A.data}
        for rate, note in ((0.00999, "rate 0.999 of the true one"), (0.01001, "rate 1.001 of the true one")):
            evidence = {"rate": rate, "weights": np.ones(n * n)}
            seconds, certificate = best_of(lambda evidence=evidence, system=system: establish(
                "network", system=system, region={}, evidence=evidence, made_by={}, margin={}), repeats=1)
            row(f"network, {n * n} lumps, {A.nnz} entries", seconds, f"{note}: valid {certificate.holds}")


if __name__ == "__main__":
    header("Checking certificates")
    modules()
    networks()
