"""Every public name, listed: none appears or goes without this list, the changelog and the docs saying so."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import robthermal as rt

MACHINE = Path(rt.__file__).parent / "systems" / "two_module.toml"
ROOT = Path(__file__).parents[1]

SURFACE = {
    "robthermal": """
        Certificate Diverged FleetRun InputError Outcome Record System Verdict __version__ calibrate calibration
        certify coupling design diagnose diagnosis errors fleet identify jobs project read_record read_records
        read_system report
        signals synthesis systems thermal verification verify
    """,
    "calibration": """
        CalibrationCode ConvectionLaw Estimates Fit ModuleBatch ModuleProperties ResponseComparison Score VaryingModel
        Whiteness calibrate convection_law convection_of_body join_models module_batch module_properties
    """,
    "certify": """
        CertifyCode CurrentBound CurrentLimit GainBound Gains LimitMap Runaway RunawayFree ThesisBounds UsableCurrent
        check_certificate check_loop_parameters claim_box closed_loop contraction frequency_norm frequency_radius gains
        heater_heat hinf invariance largest_current largest_regulated_current limit_map loop network network_peak
        observer peak regulated runaway runaway_free scheduled stability thesis_bounds usable_current
    """,
    "coupling": """
        NORMS CoprimeFactors CouplingCode Destabilizing Filters FixedPoint Joint MatrixFilters MuBound Norm
        NormalizedFactors Performance
        ScaledPath Simulation Spectra Uncertainty WorstCase coprime destabilizing discretize dual_youla evaluate
        evaluate_matrix inner_factor joint mu mu_bound normalized overbound simulate spectra synthesize
        synthesize_matrix worst_case
    """,
    "design": """
        Bounds CertifiedLoop ClosedLoop ColdSide Collapse Command ConstantGain ControllerInput DESIGN_FORMAT
        DesignCode DisturbanceObserver Estimate ExtendedKalmanFilter FeedForward FeedbackLinearization GainObserver
        LinearController LoopMargins Margins Matrices MatrixController ModalFeedback ModalReconstruction
        ObserverModel PID Placement PlantMargins
        Polarity Protection ProtectionRules Reach Reachable RegulatedPoint Seen SetpointRamp StateFeedback
        StepResponseLinearity ThermalModes Tuning certify_loop modal_feedback protection reconstruct
        setpoint_ramp thermal_modes
        check_polarity checked_margins cold_side collapse constant_gain corner_plants disturbance_observer
        face_ranges feed_forward feedback_linearization gains_digest linear_controller load_controller loop_margins
        loop_poles observer pid place_sensors reachable regulated_points simulate_law simulate_loop state_feedback
        step_response_linearity tem_feedback tem_polytope tune_pi unobservable TemFeedback
        AntiWindupDesign
        Design FeedbackDesign FrfDesign FrfMatrixDesign HybridIntegratorGain InvariantEllipsoid LpvDesign MpcDesign
        MpcStep RobustAgainst Terminal anti_windup frf_pid h2 hinf hybrid_integrator_gain invariant_ellipsoid
        lpv mixed mpc mu_synthesis output_feedback polytopic_feedback
        uncertainty_weight
    """,
    "diagnosis": """
        Adequacy Augmented Candidate Compared Decision Diagnosis DiagnosisCode Differing Effect EffectSet Entry Evidence
        Found FoundAmbient Gap HoldOut
        JointCheck JointSelection Left Refinement Resolving Split
        LinearizedRecord Location Measurement NextExperiment NoiseEstimate NoiseScaling Quantity Refit Remainder
        Response Scores ShortList Stability UnknownHeat ValidationResiduals adequacy candidates decide diagnose effects
        forget_effect hold_out locate next_experiment noise_floor refit refit_short_list register_effect score
        select_jointly unknown_heat with_named_effects
    """,
    "errors": """
        Diverged InputError Outcome OutcomeCode RobthermalError
    """,
    "identify": """
        Diffusion FractionalPole FrequencyResponse IdentifyCode PoleSensitivity bla closed_loop errors_in_variables
        etfe is_response lpm lrm lrmp mean_inputs mean_period pole_sensitivity read_response spectral
    """,
    "jobs": """
        Boxes DesignRequest MapRequest certify_system compare_modules couple_subsystems demo_project design_system
        diagnose_records explain explainable map_system new_project read_coupling read_project read_sheets
        rebuild_report run_job run_project verify_files write_certify write_coupling write_design write_diagnosis
        write_job write_map write_modules
        read_plant_file synthesize_plant write_synthesis
    """,
    "project": """
        Boxes Certification Checked Comparison ControllerDesign Coupling CouplingJob DesignRequest Diagnosed
        Explanation FileCheck Gate GateCode JobResult MapRequest Misfit Project Residuals ResponseResiduals
        SecondVerdict boxes_from_text
        calibrate_files certificate_files certify_system check_free couple_subsystems demo_project design_excitation
        design_from_text design_system diagnose_records estimate_response explain explainable import_reports
        map_from_text map_system new_project output_folder point_from_text read_coupling read_files read_measured
        read_project reading_from_text rebuild_report run_job second_verdicts verify_files write_certify
        write_checks write_coupling write_design write_diagnosis
        write_excitation write_job write_map
    """,
    "report": """
        Bound Claim Evidence Figure Printed Reason Report Section Stage Table UsableRange box_ranges current_limits
        file_hash house_style is_unchanged load_curve measured_against_model read_content residuals_before_after
        rounded_down spectra_before_after versions write_content write_html write_json write_junit
    """,
    "signals": """
        Declared DesignCheck Excitation Import ImportOptions Record
        SignalsCode Thermistor as_means block_means celsius_to_kelvin crest_factor declared design_check find_glitches
        inspect_file kelvin_to_celsius median_filter multisine multisines noise
        options_from_text prbs read_record read_records save_records shift_inputs staircase
    """,
    "synthesis": """
        AntiWindupDesign
        Design FeedbackDesign FrfDesign FrfMatrixDesign HybridIntegratorGain InvariantEllipsoid LpvDesign MpcDesign
        MpcStep RobustAgainst SynthesisCode Terminal anti_windup frf_pid h2 hinf hybrid_integrator_gain
        invariant_ellipsoid lpv mixed mpc
        mu_synthesis output_feedback polytopic_feedback
        uncertainty_weight
    """,
    "systems": """
        Scanner datasheets ferrotec scanner surrogate_module tclab tclab_two_state two_module
    """,
    "thermal": """
        AddedEffect Ambient Assembly Condensation Contact DatasheetFit Drive EffectKind Equations Equilibrium
        Feedthrough FitRange Flow Hysteresis Input Inversion Layer Lead Linear Link LoadCurve Lump Material MatrixImport
        Module ModuleParameters ModulePoint Natural Periodic PolynomialFit Polynomials Properties PwmRipple Rating
        Reduction DrivableRange drivable_range pwm_ripple Supply
        Sensor SheetInversion SinkSize SplitLump SteadyState Step Stepper System ThermalCode Trajectory add_effect
        effects exchange_faces
        fit_in_kelvin fold format_modelica format_system hinf_error invert_datasheet linearize load_curve materials
        module_from_datasheet module_from_polynomials module_point
        parameter_in_words parameter_label parse_system read_matrices read_system reduce
        simulate size_sink split_lump state_matrices steady_state system_from_matrices time_constants trajectory
        voltage_slopes
        ways_to_split write_modelica write_system constant_losses natural_losses
    """,
    "verification": """
        Certificate Verdict claim_sentence establish machine_hash not_certified same_system verify
    """,
}


@pytest.mark.parametrize("package", SURFACE)
def test_public_names_are_the_listed_ones(package: str) -> None:
    found, listed = set(public_names(package)), set(SURFACE[package].split())
    gone, new = sorted(listed - found), sorted(found - listed)
    assert not gone, f"{package}: a public name went. A script may use it: keep it, or say so in the changelog: {gone}"
    assert not new, f"{package}: list the new public names here, and in the changelog: {new}"


@pytest.mark.parametrize("package", sorted(
    ".".join(path.parent.relative_to(ROOT).parts) for path in (ROOT / "robthermal").rglob("__init__.py")
    if "__getattr__" in path.read_text(encoding="utf-8")))
def test_names_that_load_on_first_use_are_listed_before(package: str) -> None:
    """The site, notebooks and editors ask dir(), which knows no __getattr__."""
    module = import_module(package)
    assert "__dir__" in vars(module) and set(module.__all__) <= set(module.__dir__())


def test_every_package_is_listed() -> None:
    assert set(SURFACE) == {"robthermal", *rt._PACKAGES, *rt._FORMER}


def test_former_name_of_the_jobs_has_the_same_objects() -> None:
    inside = [getattr(rt.jobs, name) for name in ("certify", "claims", "couple", "design", "diagnose", "folder", "map",
                                                  "measured", "request", "run", "verify")]
    explained = sys.modules["robthermal.jobs.explanations"]  # rt.jobs.explain is the function
    assert len(rt.project.__all__) > 20
    for name in rt.project.__all__:
        homes = [module for module in (rt.jobs, explained, *inside) if hasattr(module, name)]
        assert homes, name
        assert all(getattr(module, name) is getattr(rt.project, name) for module in homes), name


def test_former_name_of_the_jobs_is_imported_as_before() -> None:
    """In a process that has imported nothing; the second checker is not among what is then loaded."""
    code = "import robthermal.project as p, robthermal as rt; from robthermal.project import run_job; " \
           "assert rt.project is p and run_job is rt.jobs.run_job; " \
           "import sys, robthermal.verification; assert 'recheck' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def public_names(package: str) -> list[str]:
    """What a package exports."""
    module = rt if package == "robthermal" else import_module(f"robthermal.{package}")
    if package == "errors":  # one file, no export list: everything it defines
        return [name for name, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__]
    return list(module.__all__)


def test_importing_the_package_loads_nothing_heavy() -> None:
    """What makes `import robthermal` slow must wait for the package that needs it, down to single submodules."""
    heavy = ("scipy", "matplotlib", "cvxpy", "clarabel", "pandas", "control", "joblib", "flint", "pydantic", "numpy")
    code = "import sys, robthermal, robthermal as rt; rt.InputError, dir(rt); print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert "robthermal.errors" in loaded
    assert [name for name in loaded if name.split(".")[0] in heavy] == []


_ON_FIRST_USE = ("control", "pandas", "matplotlib.pyplot", "scipy.signal", "scipy.stats",
                 "scipy.optimize")  # slow to import


@pytest.mark.parametrize(("package", "unused"), [
    ("errors", ("numpy", "scipy", "pandas")), ("verification", ("scipy", "pandas", "control", "cvxpy", "matplotlib")),
    ("signals", ("cvxpy", *_ON_FIRST_USE)), ("thermal", ("cvxpy", "clarabel", *_ON_FIRST_USE)),
    ("identify", ("cvxpy", "clarabel", *_ON_FIRST_USE)), ("jobs.chain", ("cvxpy", *_ON_FIRST_USE))])
def test_packages_load_no_more_than_they_need(package: str, unused: tuple[str, ...]) -> None:
    code = f"import sys, robthermal.{package}; print(*sys.modules)"
    loaded = set(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True
                                ).stdout.split())
    assert not loaded & set(unused)


def test_a_fit_and_a_response_need_no_statistics_library() -> None:
    """scipy.signal and scipy.stats take a second to import; filters and quantiles come from elsewhere."""
    code = """
import sys
import numpy as np
import robthermal as rt
bar = rt.System(ambients={"room": {"temperature": 293.15}}, lumps={"bar": {"capacity": 50.0, "initial": 293.15}},
                links=[{"between": ("bar", "room"), "conductance": 0.5}], inputs={"Q": {"lump": "bar"}},
                sensors={"T": {"lump": "bar", "noise": 0.01, "time_constant": 3.0}})
rng = np.random.default_rng(1)
heat = np.repeat(rng.uniform(0.0, 6.0, 40), 10)
drive = rt.Record(sample_time=5.0, inputs=heat, outputs=np.zeros((400, 0)), input_names=["Q"], output_names=[])
readings = rt.thermal.simulate(bar, drive).outputs + 0.01 * rng.standard_normal((400, 1))
record = rt.Record(sample_time=5.0, inputs=heat, outputs=readings, input_names=["Q"], output_names=["T"])
fit = rt.calibrate(bar, record, initial="system", parameters={"links.bar-room.conductance": (0.3, 0.8)})
assert abs(fit.parameters["links.bar-room.conductance"] - 0.5) < 0.01, fit.parameters
assert fit.ranges() and rt.identify.lpm(record).confidence_radius(0.95).min() > 0.0
print(*sys.modules)
"""
    loaded = set(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True
                                ).stdout.split())
    assert "scipy.optimize" in loaded
    assert not loaded & {"scipy.signal", "scipy.stats", "pandas", "control", "matplotlib.pyplot"}
