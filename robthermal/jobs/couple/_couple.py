"""The coupling job: filters designed or judged, every certificate verified, numbers for the report."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ... import coupling
from ...coupling import NORMS, Filters, MatrixFilters, Simulation, Spectra, Uncertainty, WorstCase
from ...errors import InputError, Outcome
from ...verification import verify
from .._outcomes import JobsCode
from ..claims import Checked
from ._file import CouplingJob

_SHOWN = 50  # exposure windows in the simulated trace
_SAMPLES, _LONGEST = 2500, 50_000  # of the trace
LIMITED = {norm.file: norm for norm in NORMS.values() if norm.limit and norm.key != "robust"}  # by certificate
_FILES = {"internal stability": "stability", "stability of the controller": "controller"} | {
    norm.proof: norm.file for norm in NORMS.values() if norm.proof}  # name of each certificate's file


@dataclass(frozen=True, eq=False)
class Coupling:
    """A coupling with everything that is known about it.

    Parameters
    ----------
    job : CouplingJob
        What was asked.
    filters : Filters or MatrixFilters
        What came out; matrices of subsystems with several inputs and outputs.
    checked : tuple of Checked
        Certificates with their independent check; the required ones first.
    spectra : Spectra
        Curves over frequency.
    worst_case : WorstCase or None
        On every measured plant; None without uncertainty, and for several inputs and outputs.
    simulation : Simulation or None
        e12 over time; None in continuous time, for several inputs and outputs, and where stability is not proven.
    """

    job: CouplingJob
    filters: Filters | MatrixFilters
    checked: tuple[Checked, ...]
    spectra: Spectra
    worst_case: WorstCase | None
    simulation: Simulation | None

    @property
    def found(self) -> bool:
        """Whether there is a coupling to speak of: an infeasible design is X = Y = 0, the loops as they were."""
        return self.filters.holds or self.filters.norms["X"] > 0 or self.filters.norms["Y"] > 0

    @property
    def remarks(self) -> tuple[Outcome, ...]:
        """What the claims about the measured plants leave out; empty if nothing."""
        uncertainty = self.filters.problem.uncertainty
        if uncertainty is None or not len(uncertainty.left_out):
            return self.job.remarks
        out, first = uncertainty.left_out / (2 * np.pi), uncertainty.omega[0] / (2 * np.pi)
        listed = f"{out[0]:.4g} Hz" if len(out) == 1 else f"{len(out)} bins, {out[0]:.4g} to {out[-1]:.4g} Hz"
        text = (f"Left out of the envelope: {listed}, where the confidence circle of a response is infinite or holds "
                f"plants that make det(I + P K0) zero. The model error assumed below {first:.4g} Hz is that at "
                f"{first:.4g} Hz.")
        return (*self.job.remarks, JobsCode.BINS_LEFT_OUT.outcome(text))

    @property
    def holds(self) -> bool:
        """Whether all that was asked for holds, and is verified as far as it is a matter of proof."""
        return self.filters.holds and all(c.good for c in self.checked if c.required)


def couple_subsystems(job: CouplingJob, progress: Callable[[str], None] = lambda stage: None) -> Coupling:
    """Design the filters of a coupling, or judge given ones, and verify every certificate.

    Parameters
    ----------
    job : CouplingJob
        Coupling job, as `read_coupling` returns it.
    progress : callable, optional
        Called with a sentence before every stage.

    Returns
    -------
    Coupling

    Raises
    ------
    InputError
        Loops, filters, responses or options that make no sense, named as in the file.

    Examples
    --------
    >>> from pathlib import Path
    >>> import robthermal as rt
    >>> loop = "plant = { num = [0.01], den = [1.0, -0.99] }\\ncontroller = 20.0\\n"
    >>> _ = Path("SPEC.toml").write_text('[coupling]\\nname = "pair"\\nsample_time = 0.01\\n'
    ...     f"[subsystems.1]\\n{loop}[subsystems.2]\\n{loop}[design]\\nX_hat = -0.9\\n")
    >>> done = rt.jobs.couple_subsystems(rt.jobs.read_coupling("SPEC.toml"))
    >>> done.holds, done.filters.verdict, done.checked[0].title
    (True, 'nominal', 'Internal stability')
    """
    progress("judging the filters" if job.manual else "designing the filters")
    filters = _filters(job)
    progress("verifying every certificate")
    checked = tuple(_checked(filters))
    progress("computing spectra")
    if isinstance(filters, MatrixFilters):
        curves = filters.spectra()
        progress("simulating")
        return Coupling(job, filters, checked, curves, None, _simulation(filters))
    curves = coupling.spectra(filters)
    worst = coupling.worst_case(filters) if filters.problem.uncertainty is not None else None
    progress("simulating")
    return Coupling(job, filters, checked, curves, worst, _simulation(filters))


def _filters(job: CouplingJob) -> Filters | MatrixFilters:
    find: Callable[..., Filters | MatrixFilters] = coupling.evaluate if job.manual else coupling.synthesize
    if job.matrices:
        find = coupling.evaluate_matrix if job.manual else coupling.synthesize_matrix
    try:
        return find(*job.plants, *job.controllers, uncertainty=_uncertainty(job), disturbances=job.disturbances,
                    **job.options)
    except InputError as error:
        raise InputError(error.what, where=f"{job.files[0]} {_place(error.where, job)}", expected=error.expected,
                         remedy=error.remedy) from None


def _uncertainty(job: CouplingJob) -> Uncertainty | None:
    """The measured plants, with what their noise may hide unless the file says otherwise."""
    if not job.measured:
        return None
    try:
        found = coupling.dual_youla(list(job.measured), job.plants, job.controllers, confidence=job.confidence,
                                    measured_in_closed_loop=job.measured_in_closed_loop)
    except InputError as error:
        raise InputError(error.what, where=error.where.replace("P_frf", "uncertainty"), expected=error.expected,
                         remedy=error.remedy) from None
    return found.with_confidence() if job.circles else found


def _place(where: str, job: CouplingJob) -> str:
    """Arguments of the python functions as keys of the file."""
    if where in ("synthesize", "synthesize_matrix") or where.startswith("synthesize,"):
        return "[design]"
    if where.startswith("uncertainty"):
        index = re.sub(r"\D", "", where) or ("0" if len(job.measured) == 1 else "")
        return f"[uncertainty] {job.measured_files[int(index)]}" if index else "[uncertainty]"
    named = re.sub(r"\bP([12])\b", r"[subsystems.\1] plant", where)
    named = re.sub(r"\bC([12])\b", r"[subsystems.\1] controller", named)
    named = re.sub(r"\bdisturbances\[([01])\]", lambda found: f"[subsystems.{int(found[1]) + 1}] disturbance", named)
    return named if "[" in named else f"[design] {named}"


def _checked(filters: Filters | MatrixFilters) -> Iterator[Checked]:
    """Required: stability, robust stability where plants were measured, and the limits a certificate proves.

    A bound that is proven but too large is a certificate, not a claim: then `filters.holds` is False and says why.
    """
    kept = {file for file, norm in LIMITED.items() if filters.norms[norm.key] <= filters.asked.get(norm.key, -1.0)}
    required = {"stability"} | kept | ({"robust"} if filters.verdict == "robust" else set())
    found = [(_FILES[what], what, certificate) for what, certificate in filters.proofs.items()]
    found.sort(key=lambda f: (f[0] not in required, f[0] != "stability", f[0].startswith("norm")))
    for key, what, certificate in found:
        yield Checked(key, what[0].upper() + what[1:], certificate, verify(certificate), key in required)


def _simulation(filters: Filters | MatrixFilters) -> Simulation | None:
    if not filters.problem.dt or not filters.nominally_stable:
        return None
    window = filters.problem.samples
    return coupling.simulate(filters, max(window, min(max(_SHOWN * window, _SAMPLES), _LONGEST)))
