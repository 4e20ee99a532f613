"""A system with every kind of part, and random drives for it."""

import numpy as np
import pytest

import robthermal as rt

FULL = """
[system]
name = "everything"
temperature_unit = "degC"
[ambients.room]
temperature = 24.0
[ambients.sink]
temperature = 20.0
[lumps.plate]
capacity = 30.0
[lumps.hot]
capacity = 5.0
[lumps.cold]
capacity = 4.0
[lumps.sample]
capacity = 15.0
initial = 26.0
[[links]]
between = ["plate", "sink"]
conductance = 1.2
[[links]]
between = ["plate", "hot"]
conductance = 9.0
[[links]]
between = ["cold", "sample"]
conductance = 5.0
[[links]]
between = ["sample", "room"]
conductance = 0.05
natural = { gain = 0.03, exponent = 0.25 }
radiation = 2.0e-10
[[links]]
between = ["sample", "plate"]
name = "shine"
conductance = 0.02
radiation = 1.0e-10
natural = { gain = 0.01, exponent = 0.3 }
[inputs.heater]
lump = "sample"
gain = 0.8
limits = [0.0, 5.0]
[modules.tem]
hot = "hot"
cold = "cold"
seebeck = { value = 0.05, slope = 7.0e-5 }
resistance = { value = 3.0, slope = 0.015 }
conductance = { value = 0.4, slope = 0.001 }
reference_temperature = 30.0
current_limits = [-2.0, 2.0]
[sensors.T_plate]
lump = "plate"
noise = 0.01
[sensors.T_sample]
lump = "sample"
noise = 0.02
time_constant = 4.0
offset = 0.3
gain = 1.03
delay = 2.5
"""


@pytest.fixture
def full() -> rt.System:
    """System with natural convection, radiation, a module, a heater, two ambients and an imperfect sensor."""
    return rt.thermal.parse_system(FULL)


@pytest.fixture
def drive(full):
    """Record of random inputs that change at every sample."""
    def make(n=200, seed=0, system=full, sample_time=1.0):
        rng = np.random.default_rng(seed)
        columns = {name: rng.uniform(0, 5, n) for name in system.input_names}
        columns |= {name: rng.uniform(-1, 1.5, n) for name in system.module_names}
        columns |= {name: 297 + np.cumsum(rng.normal(0, 0.05, n)) for name in system.ambient_names}
        return rt.Record(sample_time=sample_time, inputs=np.column_stack(list(columns.values())),
                         outputs=np.zeros((n, 0)), input_names=list(columns), output_names=[])
    return make
