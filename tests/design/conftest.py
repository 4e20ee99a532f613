"""The two-module setup, its law, cold side and a controller."""

import sys
from pathlib import Path

import module_systems
import pytest

import robthermal as rt

sys.path.insert(0, str(Path(__file__).parents[1] / "verification"))  # sampled truth about certificates


@pytest.fixture(scope="session")
def system():
    return rt.systems.two_module()


@pytest.fixture(scope="session")
def law(system):
    return rt.design.feedback_linearization(system)


@pytest.fixture(scope="session")
def plant(law):
    return rt.design.cold_side(law)


@pytest.fixture(scope="session")
def pi(plant):
    return rt.design.pid(plant, bandwidth=0.05, sample_time=1.0)


@pytest.fixture(scope="session")
def constant(system):
    """The same setup with constant S and R."""
    return module_systems.constant(system)
