"""Shared by the tests of certificates; they import a simulation of their own, which does not go through the package."""

import sys
from pathlib import Path

import pytest

import robthermal as rt

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="session")
def two():
    """The set-up with two modules."""
    return rt.systems.two_module()
