"""Linear systems as zeros, poles and gain, as state spaces, and as responses at frequencies."""

from ._cascade import grouped as grouped
from ._cascade import realize as realize
from ._exact import closed_loop_poles as closed_loop_poles
from ._joined import apart as apart
from ._joined import beside as beside
from ._joined import minus_identity as minus_identity
from ._matrix import matrix_of as matrix_of
from ._read import LTI as LTI
from ._read import connected as connected
from ._read import diagonal as diagonal
from ._read import expect_stable as expect_stable
from ._read import sample_time_of as sample_time_of
from ._read import state_space_of as state_space_of
from ._read import zpk_of as zpk_of
from ._response import Response as Response
from ._response import negative as negative
from ._response import plus_one as plus_one
from ._response import series as series
from ._response import siso as siso
from ._roots import paired as paired
from ._zpk import Zpk as Zpk
from ._zpk import constant as constant
from ._zpk import natural as natural
from ._zpk import on_boundary as on_boundary
from ._zpk import stable as stable

__all__ = ["LTI", "Response", "Zpk", "apart", "beside", "closed_loop_poles", "connected", "constant", "diagonal",
           "expect_stable", "grouped", "matrix_of", "minus_identity", "natural", "negative", "on_boundary", "paired",
           "plus_one", "realize", "sample_time_of", "series", "siso", "stable", "state_space_of", "zpk_of"]
