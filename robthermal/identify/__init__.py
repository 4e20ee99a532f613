"""Frequency responses from records that never reached steady state, with a covariance that can be believed."""

from ._bla import bla as bla
from ._closed_loop import closed_loop as closed_loop
from ._errors_in_variables import errors_in_variables as errors_in_variables
from ._etfe import etfe as etfe
from ._local_functions import Diffusion as Diffusion
from ._local_functions import FractionalPole as FractionalPole
from ._lpm import lpm as lpm
from ._lrm import lrm as lrm
from ._lrmp import lrmp as lrmp
from ._mean_period import mean_period as mean_period
from ._outcomes import IdentifyCode as IdentifyCode
from ._pole_sensitivity import PoleSensitivity as PoleSensitivity
from ._pole_sensitivity import pole_sensitivity as pole_sensitivity
from ._read_response import read_response as read_response
from ._records import mean_inputs as mean_inputs
from ._response import FrequencyResponse as FrequencyResponse
from ._response_files import is_response as is_response
from ._spectral import spectral as spectral

__all__ = ["Diffusion", "FractionalPole", "FrequencyResponse", "IdentifyCode", "PoleSensitivity", "bla", "closed_loop",
           "errors_in_variables", "etfe", "is_response", "lpm", "lrm", "lrmp", "mean_inputs", "mean_period",
           "pole_sensitivity", "read_response", "spectral"]
