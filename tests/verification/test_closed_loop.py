"""Kind "closed_loop": the loop is formed by the checker; closed forms, loops that must not be certified, mutants."""

from __future__ import annotations

import copy
import json
import math

import control
import numpy as np
import pytest
from mutant_linear import close, matrices

import robthermal as rt
from robthermal.errors import InputError
from robthermal.verification import Certificate, establish, verify


def section(plant, controller, n_meas=1, n_ctrl=1, dt=0.0):
    parts = [dict(zip("ABCD", system, strict=True)) for system in (plant, controller)]
    return {"plant": parts[0], "controller": parts[1], "n_meas": n_meas, "n_ctrl": n_ctrl, "sample_time": dt}


def made(system, region, evidence):
    return establish("closed_loop", system=system, region=region, evidence=evidence, made_by={}, margin={})


def gain(value):
    return ([], [], [[]], [[value]])


# x' = x/2 + w + u, z = x, y = x; u = -5/2 y gives 1/(s + 2): H-infinity norm 1/2, H2 norm 1/2, peak gain 1/2
LAG = section(([[0.5]], [[1, 1]], [[1], [1]], [[0, 0], [0, 0]]), gain(-2.5))
POLYNOMIAL = {"method": "polynomial"}
ELLIPSOID = {"method": "ellipsoid", "matrix": [[0.5001]], "decay": 2, "share": 0.99}


@pytest.mark.parametrize(("region", "evidence", "holds"), [
    ({"measure": "hinf", "bound": "0.50001"}, POLYNOMIAL, True),
    ({"measure": "hinf", "bound": "0.49999"}, POLYNOMIAL, False),
    ({"measure": "hinf", "bound": 0.51}, {"method": "bounded_real", "matrix": [[0.5]]}, True),
    ({"measure": "h2", "bound": 0.5001}, {"method": "lyapunov", "matrix": [[0.25001]]}, True),
    ({"measure": "h2", "bound": 0.4999}, {"method": "lyapunov", "matrix": [[0.25001]]}, False),
    ({"measure": "h2", "bound": 0.5001}, {"method": "lyapunov", "matrix": [[0.24999]]}, False),
    ({"measure": "peak", "bound": 0.51}, ELLIPSOID, True), ({"measure": "peak", "bound": 0.49}, ELLIPSOID, False),
    ({"measure": "stability", "rate": 1.999}, POLYNOMIAL, True),
    ({"measure": "stability", "rate": 2}, POLYNOMIAL, False),
    ({"measure": "region", "decay": 1.99, "radius": 2.01}, {"method": "lyapunov", "matrix": [[1]]}, True),
    ({"measure": "region", "decay": 2.01}, {"method": "lyapunov", "matrix": [[1]]}, False),
    ({"measure": "region", "decay": 1.99, "radius": 1.99}, {"method": "lyapunov", "matrix": [[1]]}, False)])
def test_closed_form_of_one_lag(region, evidence, holds):
    assert made(LAG, region, evidence).holds is holds


def test_sampled_lag():
    """x+ = x/2 with z = x + 3 w: H2 norm √(9 + 1/(1 - 1/4)), largest gain 3 + 1/(1 - 1/2)."""
    system = section(([[2.0]], [[1, 1]], [[1], [1]], [[3, 0], [0, 0]]), gain(-1.5), dt=0.1)
    norm = math.sqrt(9 + 4 / 3)
    evidence = {"method": "lyapunov", "matrix": [[1.33334]]}
    assert made(system, {"measure": "h2", "bound": norm * 1.0001}, evidence).holds
    assert not made(system, {"measure": "h2", "bound": norm * 0.9999}, evidence).holds
    assert made(system, {"measure": "hinf", "bound": 5.0001}, POLYNOMIAL).holds
    assert not made(system, {"measure": "hinf", "bound": 4.9999}, POLYNOMIAL).holds
    assert made(system, {"measure": "region", "radius": 0.501}, {"method": "lyapunov", "matrix": [[1]]}).holds
    assert not made(system, {"measure": "region", "radius": 0.499}, {"method": "lyapunov", "matrix": [[1]]}).holds


def test_the_damping_of_a_resonance_is_decided_to_a_thousandth():
    """s² + 2 ζ s + 1 = 0 with ζ = 0.3; P from its eigenvectors, as exact truth of a modal norm."""
    for wanted, holds in ((0.299, True), (0.301, False)):
        P = control.ss([[0, 1], [-1, -0.6]], [[0, 0], [1, 1]], [[1, 0], [1, 0]], 0)
        cert = rt.certify.closed_loop(P, control.ss([], [], [], [[0.0]]), measure="region", poles={"damping": wanted})
        assert cert.holds is holds


@pytest.mark.parametrize("direct", [2.0, 0.5])
def test_direct_path_of_the_plant_is_part_of_the_loop(direct):
    """y = x + d u and u = k y: u = k/(1 - k d) x, an equivalent gain of -5/2."""
    k = -2.5 / (1 - 2.5 * direct)
    system = section(([[0.5]], [[1, 1]], [[1], [1]], [[0, 0], [0, direct]]), gain(k))
    assert made(system, {"measure": "hinf", "bound": 0.5001}, POLYNOMIAL).holds
    forgotten = section(([[0.5]], [[1, 1]], [[1], [1]], [[0, 0], [0, 0]]), gain(k))
    assert not made(forgotten, {"measure": "hinf", "bound": 0.5001}, POLYNOMIAL).holds


def test_loop_that_is_not_well_posed_is_not_certified():
    system = section(([[-1.0]], [[1, 1]], [[1], [1]], [[0, 0], [0, 2]]), gain(0.5))
    for region in ({"measure": "hinf", "bound": 1e9}, {"measure": "stability"}):
        found = made(system, region, POLYNOMIAL)
        assert not found.holds and "not well-posed" in found.reason


def test_hidden_unstable_modes_are_refused():
    """A controller that cancels an unstable pole, and an unstable state that no output sees."""
    cancel = section(([[-1.0]], [[1, 1]], [[1], [1]], [[0, 0], [0, 0]]), ([[1.0]], [[0.0]], [[1.0]], [[0.0]]))
    hidden = section(([[-1.0, 0], [0, 0.1]], [[1, 1], [0, 0]], [[1, 0], [1, 0]], [[0, 0], [0, 0]]), gain(0.0))
    for system in (cancel, hidden):
        found = made(system, {"measure": "hinf", "bound": 1e6}, POLYNOMIAL)
        assert not found.holds and "not" in found.reason


@pytest.mark.parametrize("dt", [0.0, 0.3])
@pytest.mark.parametrize("seed", range(4))
def test_bounds_close_to_the_norm_of_another_way_to_close_the_loop(seed, dt):
    """Random plant with all direct paths; python-control closes the loop and a dense grid gives the norm."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((4, 4))
    A = 0.5 * A / abs(np.linalg.eigvals(A)).max() if dt else A - (np.linalg.eigvals(A).real.max() + 2) * np.eye(4)
    P = control.ss(A, rng.standard_normal((4, 4)), rng.standard_normal((5, 4)), rng.standard_normal((5, 4)), dt)
    K = control.ss(0.1 * rng.standard_normal((2, 2)) - (0 if dt else 3) * np.eye(2), 0.05 * rng.standard_normal((2, 2)),
                   0.05 * rng.standard_normal((2, 2)), 0.02 * rng.standard_normal((2, 2)), dt)
    loop = P.lft(K)
    assert loop.ninputs == 2 and loop.noutputs == 3
    w = np.append(np.linspace(0, np.pi / dt, 4000)[:-1] if dt else np.geomspace(1e-3, 1e4, 6000), 0 if dt else 1e-9)
    norm = np.linalg.norm(loop(np.exp(1j * w * dt) if dt else 1j * w), 2, axis=(0, 1)).max()
    assert rt.certify.closed_loop(P, K, bound=norm * 1.002).holds
    assert not rt.certify.closed_loop(P, K, bound=norm * 0.999).holds
    found = rt.certify.closed_loop(P, K)
    assert found.holds and norm * (1 - 1e-9) <= found.region["bound"] <= norm * 1.002


def test_channels_choose_rows_and_columns():
    """z = (x, 100 x), w = (w, 50 w): one of each is as LAG."""
    system = section(([[0.5]], [[1, 50, 1]], [[1], [100], [1]], np.zeros((3, 3))), gain(-2.5))
    one = {"outputs": [0], "inputs": [0]}
    assert made(system, {"measure": "hinf", "bound": 0.501, "channels": one}, POLYNOMIAL).holds
    for other in ({"outputs": [1], "inputs": [0]}, {"outputs": [0], "inputs": [1]}, {"outputs": [0, 1], "inputs": [0]}):
        assert not made(system, {"measure": "hinf", "bound": 0.501, "channels": other}, POLYNOMIAL).holds
    assert "disturbances 0 to performance outputs 0" in made(
        system, {"measure": "hinf", "bound": 0.501, "channels": one}, POLYNOMIAL).claim


@pytest.mark.parametrize(("path", "value"), [
    (("system", "plant", "A", 0, 0), 0.6), (("system", "plant", "B", 0, 0), 1.01),
    (("system", "plant", "C", 0, 0), 1.01), (("system", "plant", "D", 0, 0), 0.2),
    (("system", "plant", "D", 1, 1), 0.1), (("system", "plant", "D", 0, 1), -0.3),
    (("system", "controller", "D", 0, 0), -2.4), (("region", "bound"), 0.4999)])
def test_changed_digits_are_rejected(path, value):
    certificate = made(LAG, {"measure": "hinf", "bound": 0.5001}, POLYNOMIAL)
    parts = {key: copy.deepcopy(getattr(certificate, key)) for key in ("system", "region", "evidence")}
    place = parts
    for key in path[:-1]:
        place = place[key]
    assert place[path[-1]] != value
    place[path[-1]] = value
    assert not verify(Certificate(**{**vars(certificate), **parts})).valid  # the sentence
    assert not made(*parts.values()).holds  # the inequality


def test_controller_of_another_plant_is_another_machine():
    hashes = {rt.verification.machine_hash(LAG)}
    for path in (("plant", "D", 1, 1), ("controller", "D", 0, 0)):
        other = copy.deepcopy(LAG)
        other[path[0]][path[1]][path[2]][path[3]] += 1e-9
        hashes.add(rt.verification.machine_hash(other))
    assert len(hashes) == 3


def test_file_round_trip_and_changed_sentence(tmp_path):
    certificate = made(LAG, {"measure": "hinf", "bound": 0.5001}, POLYNOMIAL)
    certificate.save(tmp_path / "c.json")
    assert verify(Certificate.load(tmp_path / "c.json")).valid
    document = json.loads((tmp_path / "c.json").read_text())
    document["claim"] = document["claim"].replace("H-infinity", "H2")
    (tmp_path / "d.json").write_text(json.dumps(document))
    assert not verify(Certificate.load(tmp_path / "d.json")).valid


@pytest.mark.parametrize(("section_name", "change", "words"), [
    ("region", {"measure": "believe"}, "measure"), ("region", {"bound": -1}, "not positive"),
    ("region", {"rate": 1}, "unknown key"), ("region", {"channels": {"outputs": [1], "inputs": [0]}}, "out of range"),
    ("region", {"channels": {"outputs": [0, 0], "inputs": [0]}}, "twice"),
    ("system", {"n_meas": 3}, "2 outputs"), ("system", {"n_ctrl": 0}, "from 1 to 2"),
    ("system", {"n_ctrl": 2}, "control"),
    ("system", {"note": 1}, "unknown key"), ("system", {"controller": {"A": [], "B": [], "C": [[]], "D": [[1, 2]]}},
                                            "1 measurements"),
    ("evidence", {"method": "lyapunov"}, "method"), ("evidence", {"method": "bounded_real"}, "matrix")])
def test_malformed_content_is_an_input_error(section_name, change, words):
    parts = {"system": LAG, "region": {"measure": "hinf", "bound": 1}, "evidence": POLYNOMIAL}
    parts[section_name] = {**parts[section_name], **change}
    with pytest.raises(InputError, match=words):
        made(*parts.values())


@pytest.mark.parametrize("poles", [{}, {"radius": 3}, {"damping": 1.0}, {"decay": 0}])
def test_regions_that_say_nothing_are_refused(poles):
    with pytest.raises(InputError, match="region"):
        made(LAG, {"measure": "region", **poles}, {"method": "lyapunov", "matrix": [[1]]})


def test_mutants_close_the_loop_as_python_control_does():
    rng = np.random.default_rng(2)
    P = control.ss(*(rng.standard_normal(shape) for shape in ((3, 3), (3, 3), (4, 3), (4, 3))))
    K = control.ss(*(0.1 * rng.standard_normal(shape) for shape in ((2, 2), (2, 2), (1, 2), (1, 2))))
    system = section(*((S.A.tolist(), S.B.tolist(), S.C.tolist(), S.D.tolist()) for S in (P, K)), n_meas=2)
    A, B, C, D = matrices(close(system))
    found, wanted = C @ np.linalg.solve(0.7j * np.eye(5) - A, B) + D, P.lft(K)(0.7j)
    assert np.abs(found - wanted).max() < 1e-9 * np.abs(wanted).max()
