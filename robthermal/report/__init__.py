"""Reports: finished results laid out as one HTML page, as JUnit for a pipeline, and as a JSON summary."""

from ._content import Claim as Claim
from ._content import Report as Report
from ._content import Section as Section
from ._drawings import box_ranges as box_ranges
from ._drawings import current_limits as current_limits
from ._drawings import load_curve as load_curve
from ._evidence import Evidence as Evidence
from ._figure import Figure as Figure
from ._html import write_html as write_html
from ._provenance import file_hash as file_hash
from ._provenance import versions as versions
from ._reasons import Reason as Reason
from ._reasons import Verdict as Verdict
from ._residuals import residuals_before_after as residuals_before_after
from ._residuals import spectra_before_after as spectra_before_after
from ._stages import Stage as Stage
from ._store import is_unchanged as is_unchanged
from ._store import read_content as read_content
from ._store import write_content as write_content
from ._style import house_style as house_style
from ._summaries import write_json as write_json
from ._summaries import write_junit as write_junit
from ._table import Printed as Printed
from ._table import Table as Table
from ._traces import measured_against_model as measured_against_model
from ._usable import Bound as Bound
from ._usable import Parameters as Parameters
from ._usable import UsableRange as UsableRange
from ._usable import rounded_down as rounded_down

__all__ = ["Bound", "Claim", "Evidence", "Figure", "Printed", "Reason", "Report", "Section", "Stage", "Table",
           "UsableRange", "box_ranges", "current_limits", "file_hash", "house_style", "is_unchanged", "load_curve",
           "measured_against_model", "read_content", "residuals_before_after", "rounded_down", "spectra_before_after",
           "versions", "write_content", "write_html", "write_json", "write_junit"]
