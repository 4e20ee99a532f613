"""Instances of the public classes, as the examples of the documentation make them."""

from __future__ import annotations

import doctest
import inspect
import io
from collections.abc import Iterator
from contextlib import chdir, redirect_stdout
from functools import cache
from importlib import import_module
from tempfile import TemporaryDirectory
from types import GeneratorType
from typing import Any

import numpy as np

import robthermal as rt

# Short examples that together make nearly every class.
EXAMPLES = """calibration.calibrate calibration.convection_law calibration.join_models calibration.module_batch
certify.gains certify.hinf certify.largest_current certify.limit_map certify.runaway certify.runaway_free
certify.thesis_bounds certify.usable_current coupling.CoprimeFactors coupling.FixedPoint coupling.Joint
coupling.MatrixFilters
coupling.MuBound coupling.Simulation coupling.Spectra coupling.destabilizing coupling.normalized coupling.worst_case
design.constant_gain design.disturbance_observer design.feed_forward design.linear_controller design.load_controller
design.place_sensors design.reachable design.simulate_loop design.state_feedback design.step_response_linearity
diagnosis.Augmented diagnosis.Compared diagnosis.Differing diagnosis.Refinement diagnosis.Resolving
diagnosis.Effect diagnosis.diagnose diagnosis.next_experiment diagnosis.refit_short_list
diagnosis.select_jointly
diagnosis.score diagnosis.unknown_heat identify.lpm jobs.DesignRequest jobs.run_job jobs.certify_system
jobs.write_job report.Claim report.UsableRange signals.declared signals.design_check signals.inspect_file
identify.pole_sensitivity identify.Diffusion identify.FractionalPole
signals.multisines systems.datasheets thermal.Assembly thermal.Material thermal.Stepper thermal.add_effect
thermal.load_curve thermal.module_from_polynomials thermal.reduce thermal.steady_state thermal.system_from_matrices
thermal.trajectory thermal.invert_datasheet thermal.size_sink design.tune_pi synthesis.hinf
design.protection design.setpoint_ramp thermal.DrivableRange thermal.PwmRipple
synthesis.anti_windup synthesis.frf_pid synthesis.FrfMatrixDesign synthesis.lpv
synthesis.polytopic_feedback synthesis.invariant_ellipsoid
synthesis.mpc synthesis.hybrid_integrator_gain
design.tem_feedback design.modal_feedback""".split()


def public_classes() -> dict[type, str]:
    """Classes of the export lists, by the first name they have there; neither errors nor codes of outcomes."""
    found: dict[type, str] = {}
    for package in rt._PACKAGES:
        module = import_module(f"robthermal.{package}")
        for name in getattr(module, "__all__", ()):
            value = getattr(module, name)
            if inspect.isclass(value) and not issubclass(value, Exception) and not hasattr(value, "__members__"):
                found.setdefault(value, f"{package}.{name}")
    return found


def run_example(dotted: str) -> list[Any]:
    """What the example of a public name leaves behind."""
    package, name = dotted.split(".")
    module = import_module(f"robthermal.{package}")
    text = inspect.getdoc(getattr(module, name)) or ""
    names: dict[str, Any] = dict(vars(module))
    given = dict(names)
    with redirect_stdout(io.StringIO()):
        for example in doctest.DocTestParser().get_examples(text):
            exec(compile(example.source, dotted, "single"), names)  # the package's own documentation
    return [value for key, value in names.items() if value is not given.get(key) and key != "__builtins__"]


def by_hand() -> list[Any]:
    """Small objects that no short example leaves behind."""
    two = rt.systems.two_module()
    law, x = rt.design.feedback_linearization(two), np.full(len(two.lumps), 298.15)
    seen = rt.design.ControllerInput(np.full(2, 290.0), np.full(2, 295.0), x, np.zeros(0))
    ekf = rt.design.observer(two, ["T1", "T6"], method="ekf")
    run = rt.Record(sample_time=1.0, inputs=np.zeros((5, 2)), outputs=np.full((5, 2), 300.0),
                    input_names=["m1", "m2"], output_names=["T1", "T6"])
    bar = rt.System(ambients={"room": {"temperature": 295.0}}, lumps={"bar": {"capacity": 60.0}},
                    links=[{"between": ("bar", "room"), "conductance": 0.4}], inputs={"q": {"lump": "bar"}},
                    sensors={"T": {"lump": "bar"}})
    noise = np.random.default_rng(0).standard_normal((300, 2))
    drive = rt.Record(sample_time=20.0, inputs=5.0 * noise[:, 0], outputs=np.zeros((300, 0)), input_names=["q"],
                      output_names=[])
    measured = rt.thermal.simulate(bar, drive)
    G = rt.identify.lpm(measured.with_outputs(measured.outputs + 0.01 * noise[:, 1:]))
    return [law.command(np.full(2, -1.0), x), law.bounds(x), law.reach(x), seen, ekf, ekf.run(run),
            rt.calibrate(bar, G, parameters={"lumps.bar.capacity": (6.0, 600.0)}), rt.systems.ferrotec(),
            rt.report.Stage("design", "done", 1.5), rt.thermal.Contact(1e-5), rt.thermal.Layer("a", 1e-3, "copper"),
            rt.jobs.MapRequest(ambient=(298.15,), setpoint=(278.15,), load=(0.0,))]


def parts(value: Any, seen: set[int], depth: int = 0) -> Iterator[Any]:
    """An object of the package and all that it holds."""
    if id(value) in seen or depth > 7 or isinstance(value, str | bytes | GeneratorType):
        return
    seen.add(id(value))
    inside: list[Any] = []
    if type(value).__module__.startswith("robthermal"):
        yield value
        inside = [*getattr(value, "__dict__", {}).values(), *(value if isinstance(value, tuple) else ())]
    elif isinstance(value, dict):
        inside = list(value.values())
    elif isinstance(value, list | tuple):
        inside = list(value)
    for one in inside:
        yield from parts(one, seen, depth + 1)


@cache
def instances() -> dict[type, list[Any]]:
    """Instances of the public classes, those of the shortest examples first."""
    wanted, found = public_classes(), {}
    with TemporaryDirectory() as folder, chdir(folder):  # examples write files
        for left in (by_hand(), *map(run_example, EXAMPLES)):
            for one in parts(left, set()):
                if type(one) in wanted:
                    found.setdefault(type(one), []).append(one)
    return found
