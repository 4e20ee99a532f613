"""Set-points that can be held, and modules wired the wrong way round."""

import numpy as np
import pytest

import robthermal as rt


def stable(system, faces, load):
    found = rt.thermal.steady_state(system, setpoint=dict(zip(system.modules, faces, strict=True)), heat=load)
    return [e for e in found.equilibria if e.stable]


def test_the_range_ends_at_the_runaway(law, system):
    load = {"x11": 5.0, "x12": 5.0}
    answer = rt.design.reachable(law, 283.15, load=load)
    assert answer.outcome.code == "unreachable" and answer.binding == "runaway"
    limit, passive = (np.array(list(d.values())) for d in (answer.limit, answer.passive))
    towards = (283.15 - passive) / np.abs(283.15 - passive)
    assert stable(system, limit - 0.02 * towards, load)  # independent: continuation around the fold
    assert not stable(system, limit + 0.02 * towards, load)
    assert limit - 273.15 == pytest.approx(11.6, abs=0.1)  # errata: it settles at 11.7 with 1.55 A
    with pytest.raises(rt.InputError, match=r"m1 284\.\d+ to 318\.\d+ K.*[Ll]ower the load"):
        answer.require()


def test_the_range_ends_at_the_fold_of_the_load_curve(system, law):
    """At 5 °C the errata has q* = 3.75 W: a load slightly below is reachable, one slightly above is not."""
    room_leak = 0.0387 * (298.15 - 278.15)  # W, what the cold side takes up at 5 °C (notes: g_c per module)
    for share, reachable in ((0.97, True), (1.03, False)):
        q = 3.75 * share - room_leak
        assert bool(rt.design.reachable(law, 278.15, load={"x11": q, "x12": q}).outcome) is reachable


def test_a_current_limit_can_bind(system):
    law = rt.design.feedback_linearization(system, current_limits=(-0.3, 0.3))
    answer = rt.design.reachable(law, 283.15)
    assert answer.binding == "current" and not answer.outcome
    assert max(answer.current.values()) == pytest.approx(0.3, abs=1e-3)
    assert answer.plot() is not None


def test_reachable_set_points_give_their_currents(law, system):
    answer = rt.design.reachable(law, {"m1": 285.15, "m2": 292.15})
    assert answer.outcome and answer.require() is None
    expected = stable(system, [285.15, 292.15], {})[0].currents
    assert answer.current == pytest.approx(expected, abs=1e-6)
    assert rt.design.reachable(law, 308.15).outcome  # heating
    with pytest.raises(rt.InputError, match="kelvin"):
        rt.design.reachable(law, 10.0)
    with pytest.raises(rt.InputError, match="'m1' is driven by the feedback law"):
        rt.design.reachable(law, 290.0, inputs={"m1": 1.0})


@pytest.mark.parametrize("wrong", [(), ("m1",), ("m2",), ("m1", "m2")])
def test_reversed_modules_are_found(system, wrong):
    """Data of a machine with other parameters and noise, so that no wiring fits exactly."""
    rng = np.random.default_rng(5)
    t = np.arange(400)
    drive = np.column_stack([np.where((t > 20) & (t < 200), 0.6, -0.2), np.where(t > 150, 0.5, 0.0)])
    signs = np.array([-1.0 if name in wrong else 1.0 for name in ("m1", "m2")])
    truth = system.with_parameters({"modules.m1.seebeck.value": 0.047, "lumps.x11.capacity": 6.0})
    names = {"input_names": ["m1", "m2"]}
    run = rt.thermal.simulate(truth, rt.Record(sample_time=1.0, inputs=drive * signs, outputs=np.zeros((400, 0)),
                                               output_names=[], **names))
    data = rt.Record(sample_time=1.0, inputs=drive, outputs=run.outputs + rng.normal(0, 0.05, run.outputs.shape),
                     output_names=run.output_names, **names)
    found = rt.design.check_polarity(system, data)
    assert found.reversed == wrong
    assert found.outcome.code == ("reversed" if wrong else "as_declared")
    if wrong:
        with pytest.raises(rt.InputError, match="modules " + ", ".join(wrong) + " are reversed.*Swap the leads"):
            found.require()


def test_data_without_a_step_decide_nothing(system):
    quiet = rt.Record(sample_time=1.0, inputs=np.zeros((20, 2)), outputs=np.full((20, 1), 298.15),
                      input_names=["m1", "m2"], output_names=["T6"])
    with pytest.raises(rt.InputError, match="no module current that changes.*Step the current"):
        rt.design.check_polarity(system, quiet)
    rng = np.random.default_rng(0)
    faint = rt.Record(sample_time=1.0, inputs=1e-4 * rng.normal(size=(50, 2)), input_names=["m1", "m2"],
                      outputs=298.15 + rng.normal(0, 0.05, (50, 1)), output_names=["T6"])
    assert rt.design.check_polarity(system, faint).outcome.code == "undecided"
