"""Codes of the reasons of a verdict: what each means, and what to do."""

from __future__ import annotations

from enum import Enum


class GateCode(Enum):
    """Why a report fails, or what its reader has to know: code, meaning, remedy."""

    NOT_CERTIFIED = ("A required claim does not hold at the parameters as they stand.",
                     "Narrow the currents, ambients or heats, or improve the heat sink.")
    NOT_VERIFIED = ("The file of a required certificate is not valid.",
                    "Run the job again; the check names the inequality that fails.")
    NOT_ROBUST = ("A required claim holds at the parameters as they stand, not for all parameters in their ranges.",
                  "Narrow the currents a little, or measure the parameter that is named better.")
    VALIDATION_MISFIT = ("The model misses a record that was held out by more than the noise of the sensor explains.",
                         "Find what the model lacks with `robthermal diagnose`; or state the tolerance that is good "
                         "enough, [gate] tolerance.")
    TRAINING_MISFIT = ("The model misses the records it was fitted to by more than the noise of the sensor explains.",
                       "Find what the model lacks with `robthermal diagnose`; or state the tolerance that is good "
                       "enough, [gate] tolerance.")
    NO_VALIDATION = ("The model was not compared with any record that was held out.",
                     "Name one in [project] validation.")
    NOT_DIAGNOSED = ("Nobody looked for what the model lacks.", "Add a table [diagnose] to the project file.")
    DIAGNOSIS_UNEXPLAINED = ("The diagnosis found that something is missing, and no known effect explains it.",
                             "Look at the diagnosis; improve the model by hand.")
    DIAGNOSIS_AMBIGUOUS = ("The diagnosis found several effects that explain the records alike.",
                           "Make the experiment that the diagnosis proposes.")
    DIAGNOSIS_NAMED = ("The diagnosis names an effect that the certified model does not have.",
                       "Put it into the system file and run the job again.")
    REMAINDER = ("Beside what the diagnosis names an error beyond the noise is left; it is stated, and has no name.",
                 "Judge whether an error of that size matters; the diagnosis says what would resolve it.")
    NOT_CONVERGED = ("The calibration stopped before it converged: its parameters are no estimate, and have no ranges.",
                     "Raise [calibrate] max_iterations, start closer, or calibrate fewer parameters.")
    UNDETERMINED_PARAMETER = ("The records do not determine a parameter: its range is that of [fit].",
                              "Excite the system differently, fix the parameter, or give it a prior (sigma) if it has "
                              "none.")
    PARAMETER_AT_BOUND = ("A parameter ended at a bound of [fit].",
                          "Widen the bound if the physics allow, else doubt the structure of the model.")
    CURRENT_BEYOND_RATING = ("Currents exceed what the system file declares as the module's limit.",
                             "Ask for less current.")
    CURRENT_BEYOND_RUNAWAY = ("Currents exceed the runaway limit: beyond it more current heats.",
                              "Ask for less current.")
    CURRENT_BEYOND_INVARIANCE = ("Currents exceed those for which a box inside the stated one is never left.",
                                 "Ask for less current, or improve the heat sink.")
    BOX_BEYOND_TEMPERATURE = ("The box that is certified never to be left reaches above the stated temperatures: with "
                              "the stated heats and ambients the machine may get hotter than stated.",
                              "Narrow [certify] heat or ambient, or raise [certify] temperature.")
    HEATER_BEYOND_CLAIM = ("A heater may give more within its limits than the claims allow for.",
                           "Widen [certify] heat, or see to it that the heater never gives more.")
    RECORDS_BEYOND_CLAIM = ("An ambient or a heater of the records is outside the range that the claims are about.",
                            "Give [certify] ambient and heat what the machine meets.")
    OUTSIDE_DATA = ("A claim reaches beyond what the records hold.",
                    "Measure there, or narrow what is claimed.")
    SIMULATED_DATA = ("The records are simulated: they say nothing about a machine.", "Replace them by measurements.")
    CONSTANT_INPUT = ("An input never changes in the records: nothing can be learnt about what it does.",
                      "Change it during a measurement.")
    AMBIENT_NOT_RECORDED = ("A record does not hold an ambient: it was taken to be constant, as the system file says, "
                            "and what it really was may have moved the parameters.",
                            "Record its temperature as a column; or put ambients.NAME.temperature into [fit].")
    RESAMPLED = ("The samples of a record were not on a uniform grid: the readings were interpolated.",
                 "Let the logger sample evenly; the import report has the bound of the error.")
    NO_NOISE_STATED = ("The noise of a sensor is not stated; it was estimated from the readings.",
                       "Give `noise` in [sensors.NAME].")
    NOMINAL_ONLY = ("The claims are about exactly the parameters of the model, not about ranges of them.",
                    "Calibrate with data, or give [certify] parameters.")
    MARGIN_MISSED = ("A loop does not keep a margin that was asked for.",
                     "Ask for less bandwidth or margin; the reason says how much bandwidth is possible.")
    LOOP_NOT_ROBUST = ("A loop is unstable, or cannot hold its set-point, for some parameters in their ranges.",
                       "Ask for less bandwidth, move the set-points, or measure the parameter that is named better.")
    SETPOINT_NOT_HELD = ("Set-points cannot be held at all heats that the heaters may give within their limits.",
                         "State the heats that the machine meets, [certify] heat; move the set-points, or cool the hot "
                         "side better.")
    AT_THE_BINS = ("The controller was judged at the bins of a measured response only, in floating point: that the "
                   "loop is stable is not proven.", "Give a model of the plant for a proof; step the loop with care.")
    HEATERS_OFF = ("The heaters of the system file are off in what was computed: only the stated loads are counted.",
                   "Add the heat of the heaters to the load; certify counts them up to their limits.")
    REPORT_CHANGED = ("report.json is not what the job wrote.", "Run the job again.")

    def __init__(self, meaning: str, remedy: str) -> None:
        self.meaning = meaning
        self.remedy = remedy

    @property
    def code(self) -> str:
        """As it stands in summary.json and junit.xml."""
        return self.name.lower()
