"""Map the usable current over ambient temperature, heat load and set-point."""

from ._map import MapRequest as MapRequest
from ._map import map_from_text as map_from_text
from ._map import map_system as map_system
from ._map import write_map as write_map

__all__ = ["MapRequest", "map_from_text", "map_system", "write_map"]
