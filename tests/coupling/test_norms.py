"""One table of norms: results, files, reports and the synthesis use its keys and no others."""

from __future__ import annotations

from dataclasses import fields

import control
import numpy as np
import pytest

import robthermal as rt
from robthermal.coupling import NORMS

DT = 0.01


@pytest.fixture(scope="module")
def filters() -> rt.coupling.Filters:
    P, C = control.tf([0.01], [1, -0.99], DT), control.tf([20.0], [1], DT)
    omega = np.linspace(1.0, 314.0, 60)
    response = np.eye(2)[:, :, None] * 1.1 * P(np.exp(1j * DT * omega))
    X_hat = control.tf([0.1], [1, -0.5], DT)  # dynamic: every norm needs a certificate
    return rt.coupling.evaluate(P, P, C, C, X_hat=-X_hat, Y_hat=0.2 * X_hat,
                                uncertainty=control.FRD(response, omega))


def test_results_have_the_keys_of_the_table(filters: rt.coupling.Filters) -> None:
    assert set(filters.norms) == set(NORMS)
    assert all(key in str(filters) for key in NORMS)


def test_every_certificate_is_in_the_table_once(filters: rt.coupling.Filters) -> None:
    proofs = [norm.proof for norm in NORMS.values() if norm.proof]
    assert len(set(proofs)) == len(proofs) == len({norm.file for norm in NORMS.values() if norm.file})
    assert set(filters.proofs) - {"internal stability", "stability of the controller"} == set(proofs)
    for norm in NORMS.values():
        assert bool(norm.proof) == bool(norm.file)
        if norm.proof:  # the number of the result is the one the certificate proves
            assert float(filters.proofs[norm.proof].region["bound"]) == pytest.approx(filters.norms[norm.key]), norm


def test_proof_margins_hold_for_what_is_proven(filters: rt.coupling.Filters) -> None:
    """H-infinity norms from a dense grid, by another hand: the proven bounds are within their margins."""
    z = np.exp(1j * np.geomspace(1e-4, np.pi, 20_000))
    X, Y = (-0.1 / (z - 0.5) * filters.Z1(z), 0.02 / (z - 0.5) * filters.Z2(z))
    for key, values in {"X": X, "Y": Y, "XY": X * Y, "improvement_1": 1 + Y, "improvement_2": 1 + X}.items():
        true = np.abs(values).max()
        assert true * (1 - 1e-6) <= filters.norms[key] <= true * max(NORMS[key].proof_margin, 1.01), key


def test_limits_are_fields_of_the_design() -> None:
    from robthermal.coupling.synthesis import Limits

    limits = {norm.limit for norm in NORMS.values() if norm.limit}
    assert limits | {"msd"} == {field.name for field in fields(Limits)}
