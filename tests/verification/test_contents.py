"""Every key of a system file is in the claims, harmless to them, or refused: put new ones in their place here."""

import pytest

from robthermal.thermal import System, _parts
from robthermal.verification._fields import _EFFECTS

CLAIMED = {"Lump": {"capacity"}, "Link": {"name", "between", "conductance", "natural", "radiation"},
           "Natural": {"gain", "exponent"}, "Linear": {"value", "slope"}, "Ambient": set(),
           "Module": {"hot", "cold", "seebeck", "resistance", "conductance", "reference_temperature"},
           "Sensor": {"lump", "gain"}, "Input": set(),
           "System": {"name", "ambients", "lumps", "links", "modules", "sensors"}}
# starts, noise, limits of inputs, what a sensor adds to its reading; an observer refuses lag, delay, voltages itself
HARMLESS = {"Lump": {"disturbance", "initial"}, "Module": {"current_limits", "supply"},
            "Ambient": {"temperature", "coolant"},
            "Sensor": {"noise", "offset", "time_constant", "delay", "module", "quantity", "lead_resistance", "initial",
                       "read"},
            "Input": {"lump", "gain", "limits", "unit"},
            "System": {"temperature_unit", "inputs", "fit", "record", "columns"}}  # how files are read


@pytest.mark.parametrize("part", sorted(CLAIMED))
def test_every_key_of_a_system_file_has_its_place(part):
    fields = set((System if part == "System" else getattr(_parts, part)).model_fields)
    left = fields - CLAIMED[part] - HARMLESS.get(part, set())
    assert left <= set(_EFFECTS), f"{part}: what do {sorted(left - set(_EFFECTS))} do to the claims?"


def test_every_refused_name_is_a_key_of_a_system_file():
    parts = [System, *(getattr(_parts, part) for part in CLAIMED if part != "System")]
    assert set(_EFFECTS) <= {field for part in parts for field in part.model_fields}
