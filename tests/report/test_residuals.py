"""Residuals before and after, and claims that are tests on data instead of proofs."""

from __future__ import annotations

import numpy as np
import pytest

import robthermal as rt


def test_both_panels_show_their_own_residuals_on_one_scale() -> None:
    time = np.arange(5.0)
    figure = rt.report.residuals_before_after(time, {"T": 3.0 * time}, {"T": 0.1 * time}, noise=0.2)
    before, after = figure.axes
    assert np.allclose(before.get_lines()[0].get_ydata(), 3.0 * time)
    assert np.allclose(after.get_lines()[0].get_ydata(), 0.1 * time)
    assert before.get_ylim() == after.get_ylim()


def test_a_model_that_did_not_change_is_drawn_once() -> None:
    same = {"T": [1.0, 2.0]}
    assert len(rt.report.residuals_before_after([0.0, 1.0], same, {"T": [1.0, 2.0]}).axes) == 1
    assert len(rt.report.residuals_before_after([0.0, 1.0], same, {"T": [1.0, 2.1]}).axes) == 2
    assert len(rt.report.spectra_before_after([0.1, 0.2], same, same, unit="K").axes) == 1


@pytest.mark.parametrize(("before", "after"), [({}, {}), ({"T": [1.0, 2.0]}, {"U": [1.0, 2.0]}),
                                               ({"T": [1.0, 2.0]}, {"T": [1.0]})])
def test_what_does_not_fit_together_is_refused(before: dict, after: dict) -> None:
    with pytest.raises(rt.errors.InputError, match="residuals_before_after"):
        rt.report.residuals_before_after([0.0, 1.0], before, after)


def test_a_test_is_good_without_a_proof_but_never_called_proven() -> None:
    passed = rt.report.Claim("White", "Nothing is left.", True, None, "", "", "", tested=True)
    failed = rt.report.Claim("White", "Nothing is left.", False, None, "", "", "", tested=True)
    assert (passed.good, passed.status, passed.why) == (True, "Passed", "")
    assert (failed.good, failed.status, failed.why) == (False, "Not passed", "the test failed")


def test_a_test_cannot_claim_to_be_verified() -> None:
    with pytest.raises(rt.errors.InputError, match="a test proves nothing"):
        rt.report.Claim("White", "Nothing is left.", True, True, "", "", "", tested=True)
