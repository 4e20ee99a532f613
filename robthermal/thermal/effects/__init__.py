"""Effects that a model may lack, one file each: where they act, how they are added, how they show, what they mean.

A new effect is one file here that defines ``EFFECT``, and its test.
"""

from ._adding import AddedEffect as AddedEffect
from ._adding import add_effect as add_effect
from ._builders import Builder as Builder
from ._catalog import effects as effects
from ._catalog import forget_effect as forget_effect
from ._catalog import register_effect as register_effect
from ._effect import Effect as Effect
from ._effect import Quantity as Quantity
from ._response import RecordContext as RecordContext
from ._response import Response as Response
from ._response import Signature as Signature
from ._response import TrialContext as TrialContext

__all__ = ["AddedEffect", "Builder", "Effect", "Quantity", "RecordContext", "Response", "Signature", "TrialContext",
           "add_effect", "effects", "forget_effect", "register_effect"]
