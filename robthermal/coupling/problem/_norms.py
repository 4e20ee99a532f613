"""The numbers of a coupling: one table of their symbols, limits, certificates and proof margins."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Norm:
    """One number of a coupling, under every name it has.

    Parameters
    ----------
    key : str
        Name in `Filters.norms`, in coupling.json and in `Filters.asked`.
    symbol : str
        Formula or words for reports.
    limit : str
        Field of the design's limits that bounds it from above; empty where no argument does.
    proof : str
        Name of its certificate in `Filters.proofs`; empty where it is computed, not proven.
    file : str
        Name of the certificate's file, without ending; empty where there is none.
    proof_margin : float
        Proven bound over true value that the synthesis expects of the proof [-]; 1 where nothing is proven.
    """

    key: str
    symbol: str
    limit: str = ""
    proof: str = ""
    file: str = ""
    proof_margin: float = 1.0


_ROWS = (
    Norm("robust", "robust number ρ(|Δk| R)", "robust", "robust number", "robust", 1.003),
    Norm("robust_without_circles", "robust number of the measured values without their circles"),
    Norm("small_gain", "small gain σ(Δk) μ(Δp), Evers (6.22)"),
    Norm("X", "‖X‖∞", "", "norm of X", "norm_X"),
    Norm("Y", "‖Y‖∞", "", "norm of Y", "norm_Y"),
    Norm("XY", "‖XY‖∞", "product", "norm of XY", "norm_XY", 1.006),
    Norm("improvement_1", "‖1+Y‖∞", "improvement", "norm of 1 + Y", "norm_1_plus_Y", 1.006),
    Norm("improvement_2", "‖1+X‖∞", "improvement", "norm of 1 + X", "norm_1_plus_X", 1.006),
    Norm("hinf_uncoupled", "H∞ norm of weighted e12 without coupling", "", "norm of weighted e12 without coupling",
         "norm_weighted_e12_without_coupling"),
    Norm("hinf", "H∞ norm of weighted e12", "hinf", "norm of weighted e12", "norm_weighted_e12", 1.006),
    Norm("h2_uncoupled", "H2 norm of weighted e12 without coupling"),
    Norm("h2", "H2 norm of weighted e12"),
)
NORMS = {norm.key: norm for norm in _ROWS}  # by key, in the order of reports
