"""Peak gains against linear programs, the notes' reference values and simulated disturbances."""

from itertools import product

import numpy as np
import pytest
from module_systems import same
from scipy.optimize import linprog

import robthermal as rt

BOX = (278.15, 358.15)


def jacobians(system, span):
    eq = rt.thermal.Equations(system)
    faces = [system.lump_names.index(face) for m in system.modules.values() for face in (m.hot, m.cold)]
    for T in product(BOX, repeat=len(faces)):
        for currents in product(span, repeat=len(system.modules)):
            x, u = np.full(len(system.lumps), 300.0), eq.nominal()
            x[faces], u[:len(currents)] = T, currents
            yield eq.jacobian(x, u).toarray()


# research note D(vi): K per K of ambient at the hot and the cold TEM nodes
@pytest.mark.parametrize(("span", "hot", "cold"), [((0, 1.5), 1.26, 1.23), ((0, 3.3), 2.2, 2.1), ((-2, 2), 6.3, 12.9)])
def test_ambient_gains_of_the_notes(two, span, hot, cold):
    found = rt.certify.gains(two, current=same(two, *span), temperature=BOX, heat=["x11"])
    assert found.outcome.ok and rt.verify(found.certificate).valid
    assert found.ambient.loc[["x9", "x10"], "room"].max() == pytest.approx(hot, rel=0.02)
    assert found.ambient.loc[["x11", "x12"], "room"].max() == pytest.approx(cold, rel=0.02)


def test_gains_are_those_of_the_linear_program(two):
    span = (0.0, 1.5)
    found = rt.certify.gains(two, current=same(two, *span), temperature=BOX)
    rows = np.vstack(list(jacobians(two, span)))
    eq = rt.thermal.Equations(two)
    cases = {"room": eq.B.toarray()[:, -1], "x11": np.eye(18)[10], "x3": np.eye(18)[2]}
    for name, b in cases.items():
        least = linprog(np.ones(18), A_ub=rows, b_ub=-np.tile(b, len(rows) // 18), bounds=(0, None)).x
        claimed = (found.ambient if name == "room" else found.heat)[name].to_numpy()
        np.testing.assert_allclose(claimed, least, rtol=1e-3)
        assert (claimed >= least * (1 - 1e-9)).all()


def test_no_switching_current_parts_two_trajectories_by_more(two):
    span = (0.0, 1.5)
    found = rt.certify.gains(two, current=same(two, *span), temperature=(250.0, 358.15), heat=["x11"])
    rng, n = np.random.default_rng(0), 4000
    currents = np.repeat(rng.choice(span, (n // 100, 2)), 100, axis=0)

    def lumps(room, load):
        heater = two.model_copy(update={"inputs": {"load": rt.thermal.Input(lump="x11", gain=1.0)}})
        inputs = np.column_stack([np.full(n, load), currents, np.full(n, room)])
        record = rt.Record(sample_time=1.0, inputs=inputs, outputs=np.zeros((n, 0)), output_names=[],
                           input_names=["load", "m1", "m2", "room"])
        return rt.thermal.trajectory(heater, record, initial=np.full(18, 298.15)).lumps

    start = lumps(298.15, 0.0)
    assert start.min() > 250.0 and start.max() < 358.15
    for other, gain, size in ((lumps(303.15, 0.0), found.ambient["room"], 5.0), (lumps(298.15, 0.5), found.heat["x11"],
                                                                                  0.5)):
        apart = np.abs(other - start).max(axis=0)
        assert (apart <= size * gain.to_numpy()).all()
        assert apart.max() > 0.3 * size * gain.max()  # and the bound is of the right size


def test_uncertain_links_widen_the_gains(two):
    sharp = rt.certify.gains(two, current=same(two, 0, 1.5), temperature=BOX, heat=["x11"])
    wide = rt.certify.gains(two, current=same(two, 0, 1.5), temperature=BOX, heat=["x11"],
                            parameters={"links.x1-room.conductance": (0.5, 0.9)})
    assert wide.certificate.holds and (wide.ambient.to_numpy() > sharp.ambient.to_numpy()).all()
    corner = two.with_parameters({"links.x1-room.conductance": 0.5})
    eq = rt.thermal.Equations(corner)
    for J in jacobians(corner, (0.0, 1.5)):
        assert (np.linalg.solve(-J, eq.B.toarray()[:, -1]) <= wide.ambient["room"]).all()


def test_beyond_the_limit_there_is_no_gain(two):
    found = rt.certify.gains(two, current=same(two, -3.0, 3.0), temperature=BOX)
    assert not found.outcome.ok and not found.certificate.holds and found.ambient.empty
    assert "Not certified" in str(found)


def convecting():
    return rt.System(ambients={"room": {"temperature": 298.0}}, lumps={"bar": {"capacity": 10.0}},
                     links=[{"between": ("bar", "room"), "conductance": 0.5, "natural": {"gain": 0.1, "exponent": 0.25},
                             "radiation": 1e-10}])


def test_convection_to_an_ambient_needs_its_range():
    with pytest.raises(rt.InputError, match="ambient"):
        rt.certify.gains(convecting(), current={}, temperature=(290.0, 340.0))
    found = rt.certify.gains(convecting(), current={}, temperature=(290.0, 340.0), ambient={"room": (290.0, 300.0)})
    least = 0.5 + 4e-10 * 290.0**3  # slope of the loss, still air
    most = 0.5 + 0.1 * 1.25 * 50**0.25 + 4e-10 * 300.0**3
    assert found.ambient.loc["bar", "room"] == pytest.approx(most / least, rel=1e-3)


@pytest.mark.parametrize(("arguments", "message"), [
    ({"heat": ["x99"]}, "no lump 'x99'"), ({"ambient": {"attic": (290, 300)}}, "no ambient 'attic'"),
    ({"temperature": (5.0, 80.0)}, "degrees Celsius")])
def test_bad_input(two, arguments, message):
    with pytest.raises(rt.InputError, match=message):
        rt.certify.gains(two, **{"current": same(two, 0, 1), "temperature": BOX, **arguments})
