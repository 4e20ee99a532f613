"""Thermal systems: lumps, links, thermoelectric modules; equations, simulation, steady state, linearization."""

from ._datasheet import DatasheetFit as DatasheetFit
from ._datasheet import ModuleParameters as ModuleParameters
from ._datasheet import module_from_datasheet as module_from_datasheet
from ._drivable import DrivableRange as DrivableRange
from ._drivable import drivable_range as drivable_range
from ._equations import Equations as Equations
from ._exchange import exchange_faces as exchange_faces
from ._file import fit_in_kelvin as fit_in_kelvin
from ._file import format_system as format_system
from ._file import parse_system as parse_system
from ._file import read_system as read_system
from ._file import write_system as write_system
from ._fold import fold as fold
from ._geometry import Assembly as Assembly
from ._geometry import Contact as Contact
from ._geometry import Layer as Layer
from ._linear import linearize as linearize
from ._linear import state_matrices as state_matrices
from ._linear import time_constants as time_constants
from ._materials import Material as Material
from ._materials import materials as materials
from ._matrices import MatrixImport as MatrixImport
from ._matrices import system_from_matrices as system_from_matrices
from ._matrix_files import read_matrices as read_matrices
from ._modelica import format_modelica as format_modelica
from ._modelica import write_modelica as write_modelica
from ._module_point import ModulePoint as ModulePoint
from ._module_point import SinkSize as SinkSize
from ._module_point import module_point as module_point
from ._module_point import size_sink as size_sink
from ._natural_losses import constant_losses as constant_losses
from ._natural_losses import natural_losses as natural_losses
from ._outcomes import ThermalCode as ThermalCode
from ._parameter_words import parameter_in_words as parameter_in_words
from ._parameter_words import parameter_label as parameter_label
from ._parts import Ambient as Ambient
from ._parts import Condensation as Condensation
from ._parts import Drive as Drive
from ._parts import Feedthrough as Feedthrough
from ._parts import FitRange as FitRange
from ._parts import Flow as Flow
from ._parts import Hysteresis as Hysteresis
from ._parts import Input as Input
from ._parts import Lead as Lead
from ._parts import Linear as Linear
from ._parts import Link as Link
from ._parts import Lump as Lump
from ._parts import Module as Module
from ._parts import Natural as Natural
from ._parts import Periodic as Periodic
from ._parts import Sensor as Sensor
from ._parts import Step as Step
from ._parts import Supply as Supply
from ._polynomials import PolynomialFit as PolynomialFit
from ._polynomials import Polynomials as Polynomials
from ._polynomials import module_from_polynomials as module_from_polynomials
from ._pwm import PwmRipple as PwmRipple
from ._pwm import pwm_ripple as pwm_ripple
from ._rating import Properties as Properties
from ._rating import Rating as Rating
from ._reduce import Reduction as Reduction
from ._reduce import hinf_error as hinf_error
from ._reduce import reduce as reduce
from ._regulated import LoadCurve as LoadCurve
from ._regulated import load_curve as load_curve
from ._sheet_columns import Inversion as Inversion
from ._sheet_columns import SheetInversion as SheetInversion
from ._sheet_columns import invert_datasheet as invert_datasheet
from ._simulate import Trajectory as Trajectory
from ._simulate import simulate as simulate
from ._simulate import trajectory as trajectory
from ._split import SplitLump as SplitLump
from ._split import split_lump as split_lump
from ._split import ways_to_split as ways_to_split
from ._steady import Equilibrium as Equilibrium
from ._steady import SteadyState as SteadyState
from ._steady import steady_state as steady_state
from ._stepping import Stepper as Stepper
from ._system import System as System
from ._voltage import voltage_slopes as voltage_slopes
from .effects import AddedEffect as AddedEffect
from .effects import Effect as EffectKind  # the same object as `rt.diagnosis.Effect`
from .effects import add_effect as add_effect
from .effects import effects as effects

__all__ = ["AddedEffect", "Ambient", "Assembly", "Condensation", "Contact", "DatasheetFit", "DrivableRange", "Drive",
           "EffectKind", "Equations", "Equilibrium", "Feedthrough", "FitRange", "Flow", "Hysteresis", "Input",
           "Inversion", "Layer", "Lead", "Linear", "Link", "LoadCurve", "Lump", "Material", "MatrixImport", "Module",
           "ModuleParameters", "ModulePoint", "Natural", "Periodic", "PolynomialFit", "Polynomials", "Properties",
           "PwmRipple", "Rating", "Reduction", "Sensor", "SheetInversion", "SinkSize", "SplitLump", "SteadyState",
           "Step", "Stepper", "Supply", "System", "ThermalCode", "Trajectory", "add_effect", "constant_losses",
           "drivable_range", "effects", "exchange_faces", "fit_in_kelvin", "fold", "format_modelica", "format_system",
           "hinf_error", "invert_datasheet", "linearize", "load_curve", "materials", "module_from_datasheet",
           "module_from_polynomials", "module_point", "natural_losses", "parameter_in_words", "parameter_label",
           "parse_system", "pwm_ripple", "read_matrices", "read_system", "reduce", "simulate", "size_sink",
           "split_lump", "state_matrices", "steady_state", "system_from_matrices", "time_constants", "trajectory",
           "voltage_slopes", "ways_to_split", "write_modelica", "write_system"]
