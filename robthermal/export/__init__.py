"""What every exporter shares: document, C99 source with its test vector, files that appear whole or not at all."""

from ._c99 import comment as comment
from ._c99 import doubles as doubles
from ._c99 import identifier as identifier
from ._c99 import number as number
from ._c99 import rows as rows
from ._program import Program as Program
from ._write import by_suffix as by_suffix
from ._write import json_bytes as json_bytes
from ._write import matlab_bytes as matlab_bytes
from ._write import plain as plain
from ._write import write_export as write_export

__all__ = ["Program", "by_suffix", "comment", "doubles", "identifier", "json_bytes", "matlab_bytes", "number", "plain",
           "rows", "write_export"]
