"""Design a controller within certified currents, and write it."""

from ._design import ControllerDesign as ControllerDesign
from ._design import design_system as design_system
from ._report import design_report as design_report
from ._report import save_design as save_design
from ._report import write_design as write_design
from ._request import DesignRequest as DesignRequest
from ._request_text import design_from_table as design_from_table
from ._request_text import design_from_text as design_from_text

__all__ = ["ControllerDesign", "DesignRequest", "design_from_table", "design_from_text", "design_report",
           "design_system", "save_design", "write_design"]
