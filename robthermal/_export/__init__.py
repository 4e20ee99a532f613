"""What every exporter shares: C99 text, MATLAB structs, files that appear whole or not at all."""

from ._c99 import comment as comment
from ._c99 import doubles as doubles
from ._c99 import identifier as identifier
from ._c99 import number as number
from ._c99 import rows as rows
from ._c99 import self_test as self_test
from ._write import by_suffix as by_suffix
from ._write import json_bytes as json_bytes
from ._write import matlab_bytes as matlab_bytes
from ._write import write as write

__all__ = ["by_suffix", "comment", "doubles", "identifier", "json_bytes", "matlab_bytes", "number", "rows", "self_test",
           "write"]
