"""Effects that a model may lack: what they are, where they act, how they would show."""

from ._catalogue import candidates as candidates
from ._catalogue import effects as effects
from ._catalogue import forget_effect as forget_effect
from ._catalogue import register_effect as register_effect
from ._effect import Candidate as Candidate
from ._effect import Effect as Effect
from ._effect import Quantity as Quantity
from ._response import Response as Response
from ._response import Seen as Seen

__all__ = ["Candidate", "Effect", "Quantity", "Response", "Seen", "candidates", "effects", "forget_effect",
           "register_effect"]
