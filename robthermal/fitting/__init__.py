"""What fits of a system to data share: checked data, ranges and priors, starts, noise, residuals and free runs.

Shared by the packages calibration, diagnosis, report and jobs; not part of the public interface.
"""

from ._data import Data as Data
from ._data import as_data as as_data
from ._data import refuse_same as refuse_same
from ._data import refuse_short as refuse_short
from ._exchanged_lag import exchanged_lags as exchanged_lags
from ._exchanged_lag import lagged_parts as lagged_parts
from ._exchanged_lag import own_times as own_times
from ._free_run import FreeRun as FreeRun
from ._free_run import free_run as free_run
from ._measured import Measured as Measured
from ._measured import measured_of as measured_of
from ._measured_response import MeasuredResponse as MeasuredResponse
from ._measured_response import measured_response as measured_response
from ._misread import misread as misread
from ._misread_rows import Mended as Mended
from ._misread_rows import mended as mended
from ._noise import LOSSES as LOSSES
from ._noise import Loss as Loss
from ._noise import declared_noise as declared_noise
from ._noise import estimated_noise as estimated_noise
from ._noise import quantum as quantum
from ._noise import scipy_loss as scipy_loss
from ._noise import score as score
from ._noise import score_slope as score_slope
from ._noise import smallest_noise as smallest_noise
from ._operating_point import OperatingPoint as OperatingPoint
from ._problem import Problem as Problem
from ._problem import Weigh as Weigh
from ._problem import scaled as scaled
from ._ranges import NONE as NONE
from ._ranges import Choice as Choice
from ._ranges import Ranges as Ranges
from ._ranges import chosen_ranges as chosen_ranges
from ._residual import counted as counted
from ._residual import rmse as rmse
from ._residual import rmse_by_sensor as rmse_by_sensor
from ._response_whitening import ResponseWhitener as ResponseWhitener
from ._response_whitening import as_complex as as_complex
from ._response_whitening import as_real as as_real
from ._sampled_response import sampled_response as sampled_response
from ._start import COLDEST as COLDEST
from ._start import HOTTEST as HOTTEST
from ._start import STARTS as STARTS
from ._start import Initial as Initial
from ._start import Start as Start
from ._start import initial_of as initial_of
from ._start import start_values as start_values
from ._start import started as started
from ._voltage_steps import between_currents as between_currents
from ._voltage_steps import read_while_changing as read_while_changing
from ._voltage_steps import steps_of_current as steps_of_current
from ._voltage_steps import without_steps as without_steps
from ._within_steps import within_steps as within_steps
