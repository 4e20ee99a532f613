"""Measured files and tables as records: what is unambiguous is done and reported, what would be a guess is refused."""

from ._inspect import inspect as inspect
from ._options import Declared as Declared
from ._options import ImportOptions as ImportOptions
from ._options import declared as declared
from ._options import from_text as from_text
from ._read import read_record as read_record
from ._read import read_records as read_records
from ._report import Import as Import
from ._report import ImportedColumn as ImportedColumn

__all__ = [
    "Declared",
    "Import",
    "ImportOptions",
    "ImportedColumn",
    "declared",
    "from_text",
    "inspect",
    "read_record",
    "read_records",
]
