"""Thermal modes, their reconstruction from few thermometers, and control of those that the tool point feels."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from scipy.linalg import expm

import robthermal as rt

LUMPS = {"frame": 900.0, "left": 250.0, "middle": 400.0, "right": 250.0, "holder": 80.0}  # J/K
LINKS = [("frame", "left", 1.2), ("frame", "right", 1.0), ("left", "middle", 3.0), ("middle", "right", 3.0),
         ("middle", "holder", 0.8), ("frame", "room", 1.5), ("left", "room", 0.15), ("right", "room", 0.15),
         ("middle", "room", 0.2), ("holder", "room", 0.1)]  # W/K
YAW = {"left": 1.2e-6, "right": -1.2e-6}  # the arms push the tool point apart, m/K
HEATERS, THREE = ["h_left", "h_right"], ["T_left", "T_right", "T_middle"]


def stage(lumps: dict[str, float] = LUMPS, links: list = LINKS, **more: object) -> rt.System:
    """A stage between two arms, with a motor on the left one."""
    inputs = {"motor": "left", "lamp": "holder", "h_left": "left", "h_right": "right", "h_middle": "middle"}
    return rt.System(name="stage", ambients={"room": {"temperature": 295.0}},
                     lumps={name: {"capacity": value} for name, value in lumps.items()},
                     links=[{"between": (a, b), "conductance": g} for a, b, g in links],
                     inputs={name: {"lump": lump} for name, lump in inputs.items()},
                     sensors={f"T_{lump}": {"lump": lump} for lump in ("left", "right", "middle")}, **more)


def network() -> tuple[np.ndarray, np.ndarray]:
    """Capacities and conduction matrix, put together by hand."""
    names, K = list(LUMPS), np.zeros((5, 5))
    for a, b, g in LINKS:
        i = names.index(a)
        K[i, i] += g
        if b != "room":
            j = names.index(b)
            K[j, j] += g
            K[i, j] -= g
            K[j, i] -= g
    return np.array(list(LUMPS.values())), K


def test_modes_solve_the_pencil_and_decay_alone() -> None:
    modes, (E, K) = rt.design.thermal_modes(stage(), expansion=YAW), network()
    np.testing.assert_allclose(K @ modes.shapes, E[:, None] * modes.shapes * modes.rates, atol=1e-12)
    np.testing.assert_allclose(modes.shapes.T @ np.diag(E) @ modes.shapes, np.diag(modes.capacities), atol=1e-10)
    assert (np.diff(modes.rates) > 0).all() and np.abs(modes.shapes).max(axis=0).tolist() == [1.0] * 5
    for i in range(5):
        after = expm(-K / E[:, None] * 100.0) @ modes.shapes[:, i]
        np.testing.assert_allclose(after, np.exp(-100.0 * modes.rates[i]) * modes.shapes[:, i], atol=1e-12)


def test_displacements_of_the_modes_add_up_to_the_whole() -> None:
    modes, (_, K) = rt.design.thermal_modes(stage(), expansion=YAW), network()
    row = np.array([YAW.get(name, 0.0) for name in LUMPS])
    into = {"motor": np.array([0, 1.0, 0, 0, 0]), "lamp": np.array([0, 0, 0, 0, 1.0]),
            "room": np.array([1.5, 0.15, 0.2, 0.15, 0.1])}
    for name, heat in into.items():
        assert modes.static(name).sum() == pytest.approx(row @ np.linalg.solve(K, heat), rel=1e-9, abs=1e-18)
    order = modes.felt(["motor"])
    assert order[0] == np.argmax(abs(modes.static("motor"))) == 3  # left against right, 59 s
    assert modes.table(["motor"]).shape == (5, 4)


def test_observability_is_that_of_the_gramian() -> None:
    """A symmetric stage: from its middle the mode of the two arms against each other is not seen."""
    links = [(a, b, 1.1 if a == "frame" and b != "room" else g) for a, b, g in LINKS]
    modes = rt.design.thermal_modes(stage(links=links), expansion=YAW)
    A = -np.diag(modes.rates)
    for sensors in (["T_middle"], ["T_left"], ["T_left", "T_middle"]):
        C = modes.readings[[list(modes.sensors).index(name) for name in sensors]] @ modes.shapes
        W = control.lyap(A.T, C.T @ C)
        np.testing.assert_array_equal(modes.observable(sensors), np.diag(W) > 1e-12)
    assert modes.observable(["T_middle"]).sum() == 4
    same = rt.design.thermal_modes(  # two arms that are not linked: one rate twice
        stage(links=[("left", "room", 1.0), ("right", "room", 1.0), ("middle", "room", 1.0), ("frame", "room", 9.0),
                     ("holder", "room", 3.0)]), expansion=YAW)
    assert same.observable(["T_left"]).sum() == 0
    assert same.observable(["T_left", "T_right"])[np.isclose(same.rates, 1 / 250)].all()


def test_reconstruction_is_exact_for_its_modes_and_states_its_error_for_the_others() -> None:
    modes = rt.design.thermal_modes(stage(), expansion=YAW)
    seen = rt.design.reconstruct(modes, THREE, [3, 0])
    rng, C = np.random.default_rng(0), modes.readings @ modes.shapes
    z = rng.normal(size=5)
    readings, true = C @ z, modes.tool_gains @ z
    np.testing.assert_allclose(seen.matrix @ readings - z[[3, 0]], seen.spillover @ z, atol=1e-12)
    assert seen.tool @ readings - true == pytest.approx(seen.tool_error @ z, abs=1e-18)
    assert abs(seen.tool_error[[0, 3]]).max() == 0.0 and abs(seen.tool_error[[1, 2, 4]]).max() > 0.0
    noise = 0.01 * rng.normal(size=(20000, 3))
    of_modes, of_tool = seen.noise(0.01)
    np.testing.assert_allclose((noise @ seen.matrix.T).std(axis=0), of_modes, rtol=0.03)
    assert (noise @ seen.tool).std() == pytest.approx(of_tool, rel=0.03)


def norm(modes: rt.design.ThermalModes, K: control.StateSpace, feed_forward: np.ndarray | None, acting: list[str],
         heaters: list[str], sensors: list[str]) -> float:
    """Largest gain from the disturbances to the tool point on a grid, in lumps and formed by hand [m/unit]."""
    E, conduction = network()
    names = list(modes.inputs)
    B = modes.heat / E[:, None]
    Bd, Bu = B[:, [names.index(n) for n in acting]], B[:, [names.index(n) for n in heaters]]
    C = modes.readings[[list(modes.sensors).index(n) for n in sensors]]
    Bd = Bd if feed_forward is None else Bd + Bu @ feed_forward
    found = 0.0
    for w in np.geomspace(1e-6, 10.0, 600):
        G = np.linalg.solve(1j * w * np.eye(5) + conduction / E[:, None], np.hstack([Bd, Bu]))
        k = np.atleast_2d(K(1j * w))
        x = np.linalg.solve(np.eye(5) - G[:, Bd.shape[1]:] @ k @ C, G[:, :Bd.shape[1]])
        found = max(found, float(np.linalg.norm(modes.expansion @ x)))
    return found


def test_the_proven_gain_is_that_of_the_whole_network() -> None:
    modes, acting = rt.design.thermal_modes(stage(), expansion=YAW), ["motor", "room"]
    d = rt.design.modal_feedback(modes, sensors=THREE, heaters=HEATERS, disturbances=acting, bandwidth=0.05)
    assert d.holds and d.controlled == (3,) and all(rt.verify(one).valid for one in d.certificates)
    without = norm(modes, control.ss([], [], [], np.zeros((2, 3))), None, acting, HEATERS, THREE)
    with_feedback = norm(modes, d.controller, None, acting, HEATERS, THREE)
    both = norm(modes, d.controller, d.feed_forward, acting, HEATERS, THREE)
    assert d.open_gain == pytest.approx(without, rel=1e-3)
    assert with_feedback <= d.value < 1.01 * with_feedback and both <= d.value_with_feed_forward < 1.01 * both
    assert d.value < 0.35 * d.open_gain
    motor = rt.design.modal_feedback(modes, sensors=THREE, heaters=HEATERS, disturbances=["motor"], bandwidth=0.05)
    assert motor.open_gain == pytest.approx(271e-9, rel=0.01)  # the numbers of the documentation
    assert motor.value == pytest.approx(79.3e-9, rel=0.01)
    assert motor.value_with_feed_forward == pytest.approx(19.2e-9, rel=0.01)
    assert motor.reconstruction.modes.tolist() == [3, 0, 1] and motor.reconstruction.modes[0] == motor.controlled[0]


def test_feed_forward_leaves_the_mode_unmoved_at_every_moment() -> None:
    modes, (E, K) = rt.design.thermal_modes(stage(), expansion=YAW), network()
    d = rt.design.modal_feedback(modes, sensors=THREE, heaters=HEATERS, disturbances=["motor"], bandwidth=0.05)
    x, F = np.zeros(5), d.feed_forward[:, 0]
    step = expm(-K / E[:, None] * 2.0)
    held = np.linalg.solve(K, np.eye(5) - step.T).T  # integral of the step, times 1/E from the right by symmetry
    held = np.linalg.solve(-K / E[:, None], step - np.eye(5)) / E
    amplitude, others = [], []
    for k in range(400):
        motor = 1.0 + np.sin(0.05 * k)
        heat = np.array([0.0, motor * (1 + F[0]), 0.0, motor * F[1], 0.0])
        x = step @ x + held @ heat
        z = modes.shapes.T @ (E * x) / modes.capacities
        amplitude.append(abs(z[3]))
        others.append(abs(z[0]))
    assert max(amplitude) < 1e-12 and max(others) > 0.01


def test_it_spends_less_heat_than_holding_every_temperature() -> None:
    """The same yaw from two PIs that hold both arms and from one PI on the mode; the room warms by 1 K."""
    modes, K = rt.design.thermal_modes(stage(), expansion=YAW), network()[1]
    d = rt.design.modal_feedback(modes, sensors=["T_left", "T_right"], heaters=HEATERS, disturbances=["motor"],
                                 bandwidth=0.05)

    def rest(gains: np.ndarray, heat: np.ndarray) -> tuple[float, float]:
        """Yaw [m] and heaters' norm [W] in the end, the integrators at rest on what `gains` read."""
        B, C = np.eye(5)[:, [1, 3]], np.eye(5)[[1, 3]]
        directions = np.linalg.pinv(gains) if gains.shape[0] == 2 else d.controller.C
        whole = np.block([[K, -B @ directions], [gains @ C, np.zeros((len(gains), len(gains)))]])
        x = np.linalg.solve(whole, np.concatenate([heat, np.zeros(len(gains))]))
        return float(modes.expansion @ x[:5]), float(np.linalg.norm(directions @ x[5:]))

    warm, motor = np.array([1.5, 0.15, 0.2, 0.15, 0.1]), np.array([0, 1.0, 0, 0, 0])
    for heat, saved in ((warm, 0.04), (motor, 0.7)):
        yaw_all, effort_all = rest(np.eye(2), heat)
        yaw_mode, effort_mode = rest(d.reconstruction.matrix[:1], heat)
        assert abs(yaw_all) < 1e-15 and abs(yaw_mode) < 13e-9
        assert effort_mode < saved * effort_all


def test_a_loop_that_the_other_modes_upset_is_not_certified() -> None:
    """Thermometer and heater at the ends of a chain: with all modes the fast loop is unstable, in truth too."""
    modes = rt.design.thermal_modes(stage(), expansion={"holder": 1e-6})
    chosen = {"sensors": ["T_left"], "heaters": ["lamp"], "disturbances": ["motor"]}
    slow, fast = (rt.design.modal_feedback(modes, bandwidth=w, **chosen) for w in (1e-4, 0.2))
    assert slow.holds and not fast.holds and fast.outcome.code == "not_certified" and "unstable" in str(fast)
    E, K = network()
    A = np.block([[-K / E[:, None] + np.outer(np.eye(5)[:, 4] / E[4], fast.controller.D[0] * np.eye(5)[1]),
                   np.outer(np.eye(5)[:, 4] / E[4], fast.controller.C[0])], [fast.controller.B @ np.eye(5)[[1]],
                                                                             np.zeros((1, 1))]])
    assert np.linalg.eigvals(A).real.max() > 0


def test_certificates_of_another_loop_are_rejected() -> None:
    d = rt.design.modal_feedback(rt.design.thermal_modes(stage(), expansion=YAW), sensors=THREE, heaters=HEATERS,
                                 disturbances=["motor"], bandwidth=0.05)
    cert = d.certificates[0]
    weaker = {**cert.system, "controller": {**cert.system["controller"],
                                            "C": (0.1 * np.asarray(cert.system["controller"]["C"])).tolist(),
                                            "D": (0.1 * np.asarray(cert.system["controller"]["D"])).tolist()}}
    tighter = {**cert.region, "bound": 0.9 * cert.region["bound"]}
    for changed in (replace(cert, system=weaker), replace(cert, region=tighter)):
        assert not rt.verify(changed).valid


def test_bad_arguments_are_named() -> None:
    modes = rt.design.thermal_modes(stage(), expansion=YAW)
    for arguments, words in (
            ({"expansion": {"door": 1.0}}, "door"), ({"expansion": {}}, "no lump"),
            ({"expansion": {"left": 0.0}}, "zero"), ({"expansion": {"left": np.nan}}, "finite")):
        with pytest.raises(rt.InputError, match=words):
            rt.design.thermal_modes(stage(), **arguments)
    with pytest.raises(rt.InputError, match="not symmetric"):
        rt.design.thermal_modes(rt.systems.two_module(), expansion={"x1": 1e-6}, inputs={"m1": 1.0})
    with pytest.raises(rt.InputError, match="tell 2 modes apart"):
        rt.design.reconstruct(modes, ["T_left"], [0, 1])
    with pytest.raises(rt.InputError, match="different numbers"):
        rt.design.reconstruct(modes, ["T_left"], [7])
    good = {"sensors": THREE, "heaters": HEATERS, "disturbances": ["motor"], "bandwidth": 0.05}
    for changed, words in (({"heaters": ["motor"]}, "heater and a disturbance"), ({"count": 3}, "3 modes"),
                           ({"sensors": ["T9"]}, "T9"), ({"heaters": []}, "no name"),
                           ({"heaters": ["lamp", "lamp"]}, "twice"), ({"bandwidth": -1.0}, "bandwidth")):
        with pytest.raises(rt.InputError, match=words):
            rt.design.modal_feedback(modes, **{**good, **changed})
