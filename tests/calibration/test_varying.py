"""Local calibrations joined over temperature, against a machine whose property really varies."""

import numpy as np
import pytest

import robthermal as rt

NAME = "modules.m.seebeck.value"
SLOPE = 2.0e-4  # V/K²


def module(seebeck):
    """One module with constant properties between two plates."""
    links = [{"between": ("h", "room"), "conductance": 2.0}, {"between": ("c", "room"), "conductance": 0.3}]
    tem = {"hot": "h", "cold": "c", "seebeck": seebeck, "resistance": 3.0, "conductance": 0.3}
    return rt.System(ambients={"room": {"temperature": 300.0}}, links=links, modules={"m": tem},
                     lumps={"h": {"capacity": 20.0}, "c": {"capacity": 10.0}},
                     sensors={"Th": {"lump": "h", "noise": 0.01}, "Tc": {"lump": "c", "noise": 0.01}})


def local_fit(temperature, seed):
    """Small current steps about an ambient temperature; the true S follows the line."""
    rng = np.random.default_rng(seed)
    truth = module(0.05 + SLOPE * (temperature - 300.0))
    current = np.repeat(rng.uniform(-0.2, 0.2, 20), 20)
    drive = rt.Record(sample_time=1.0, inputs=np.column_stack([current, np.full(400, temperature)]),
                      outputs=np.zeros((400, 0)), input_names=["m", "room"], output_names=[])
    clean = rt.thermal.simulate(truth, drive)
    measured = rt.Record(sample_time=1.0, inputs=drive.inputs, input_names=["m", "room"], output_names=["Th", "Tc"],
                         outputs=clean.outputs + rng.normal(0, 0.01, clean.outputs.shape))
    return rt.calibrate(module(0.05), measured, parameters={NAME: (0.02, 0.1)})


@pytest.fixture(scope="module")
def joined():
    return rt.calibration.join_models({T: local_fit(T, i) for i, T in enumerate((340.0, 280.0, 300.0, 320.0))})


def test_the_line_is_found_within_its_uncertainty(joined):
    trend = joined.trend().loc[NAME]
    assert abs(trend["slope"] - SLOPE) < 4 * trend["std"] and trend["std"] < 0.1 * SLOPE
    assert trend["p_value"] > 1e-3
    assert joined.temperatures.tolist() == [280.0, 300.0, 320.0, 340.0]


def test_between_the_models_the_parameters_and_the_linear_model_are_interpolated(joined):
    expected = 0.5 * (joined.values[1, 0] + joined.values[2, 0])
    assert joined.parameters(310.0)[NAME] == pytest.approx(expected, rel=1e-12)
    assert joined.at(310.0).parameter(NAME) == pytest.approx(expected, rel=1e-12)
    G = joined.linearize(310.0)
    gain = G.B[G.state_labels.index("c"), G.input_labels.index("m")] * 10.0  # -S T of the cold face [W/A]
    assert gain == pytest.approx(-expected * 310.0, rel=1e-9)


def test_a_bent_property_is_not_called_a_line(joined):
    nonlinear = joined.values.copy()
    nonlinear[1] += 20 * joined.std[1]
    crooked = rt.calibration.VaryingModel(system=joined.system, names=joined.names, temperatures=joined.temperatures,
                                          values=nonlinear, std=joined.std)
    assert crooked.trend().loc[NAME, "p_value"] < 1e-6


def test_bad_input_is_refused(joined):
    fit = local_fit(300.0, 9)
    with pytest.raises(rt.InputError, match="fewer than two"):
        rt.calibration.join_models({300.0: fit})
    with pytest.raises(rt.InputError, match="Add 273.15"):
        rt.calibration.join_models({25.0: fit, 300.0: fit})
    with pytest.raises(rt.InputError, match="does not extrapolate"):
        joined.at(350.0)
