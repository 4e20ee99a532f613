"""Certify a system: contraction, a box that is never left, usable currents; and what the report says of them."""

from ._claims import certify_system as certify_system
from ._claims import claims_hold as claims_hold
from ._currents import CODES as CODES
from ._currents import box_stays_inside as box_stays_inside
from ._currents import current_reasons as current_reasons
from ._currents import rest_on_certificates as rest_on_certificates
from ._currents import within_usable as within_usable
from ._parameter_ranges import claim_ranges as claim_ranges
from ._parameter_ranges import converged as converged
from ._parameter_ranges import doubted as doubted
from ._reasons import CERTIFY_GATES as CERTIFY_GATES
from ._reasons import certification_reasons as certification_reasons
from ._reasons import remark as remark
from ._reasons import stays_usable as stays_usable
from ._sections import certification_sections as certification_sections
from ._table import certify_table as certify_table
from ._write import certification_report as certification_report
from ._write import write_certify as write_certify

__all__ = ["CERTIFY_GATES", "CODES", "box_stays_inside", "certification_reasons", "certification_report",
           "certification_sections", "certify_system", "certify_table", "claim_ranges", "claims_hold", "converged",
           "current_reasons", "doubted", "remark", "rest_on_certificates", "stays_usable", "within_usable",
           "write_certify"]
