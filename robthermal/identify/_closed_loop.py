"""Closed loop, indirect: responses from the reference to u and to y, then their quotient. Evers (3.25)-(3.29)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from robthermal._arrays import Array
from robthermal.errors import InputError
from robthermal.signals import Record

from .._checks import whole_number
from ._basis import LocalBasis
from ._local import LocalEstimate
from ._lpm import undetermined_inputs
from ._records import as_records, check_excitation, mean_inputs, rounding_of, spectrum_of
from ._regions import quantile
from ._response import FrequencyResponse
from ._suspect import suspect_bins


def closed_loop(
    record: Record | Sequence[Record],
    reference: ArrayLike | Sequence[ArrayLike],
    degree: int = 2,
    half_width: int = 8,
    inverse: Literal["matrix", "elementwise"] = "matrix",
) -> FrequencyResponse:
    """Plant of a closed loop from a reference that the noise does not depend on.

    The direct estimate ``lpm(record)`` is biased here, because u contains the noise by way of the controller (3.24).

    Parameters
    ----------
    record : Record or sequence of Record
        Plant inputs u and outputs y, measured in closed loop.
    reference : array_like, shape (n, n_r), or a list of them
        External signal: set-points, or excitation added to u. One column per plant input; one array per record.
    degree : int
        Degree of the local polynomials [-].
    half_width : int
        Bins on either side of the center that a window uses [-].
    inverse : {"matrix", "elementwise"}
        "matrix" gives the plant G_yr G_ur^-1 (3.28). "elementwise" gives G_yr[i,j]/G_ur[i,j]; its diagonal is the
        equivalent plant, each loop with the other loops closed (3.27).

    Returns
    -------
    FrequencyResponse
        First-order covariance of the quotient. `suspect` marks bins where G_ur does not differ significantly from a
        singular matrix; `confidence_radius` grows there and becomes infinite.

    Raises
    ------
    InputError
        For a reference that is constant, of another length, or with another number of columns than the plant inputs.

    References
    ----------
    Evers (2021), Sec. 3.5. Fieller (1954), Some problems in interval estimation, J. Royal Stat. Soc. B 16.

    Examples
    --------
    >>> import numpy as np
    >>> import robthermal as rt
    >>> rng = np.random.default_rng(3)
    >>> r, v = rng.normal(size=2000), 0.05 * rng.normal(size=2000)
    >>> x, u, y = np.zeros(2000), np.zeros(2000), np.zeros(2000)
    >>> for n in range(2000):
    ...     y[n] = x[n] + v[n]
    ...     u[n] = r[n] - 0.5 * y[n]
    ...     x[(n + 1) % 2000] = 0.8 * x[n] + 0.4 * u[n]
    >>> record = rt.Record(sample_time=1.0, inputs=u, outputs=y, input_names=["u"], output_names=["y"])
    >>> G = rt.identify.closed_loop(record, reference=r)
    >>> error = abs(G.response[0, 0] - 0.4 / (np.exp(2j * np.pi * G.frequencies) - 0.8))
    >>> bool(np.mean(error < G.confidence_radius(0.95)[0, 0]) > 0.9)
    True
    """
    records = as_records(record)
    degree = whole_number(degree, "degree", least=0)
    half_width = whole_number(half_width, "half_width", least=1)
    if not isinstance(inverse, str) or inverse not in ("matrix", "elementwise"):
        raise InputError(f"inverse is {inverse!r}", where="inverse", expected="'matrix' or 'elementwise'")
    several = not isinstance(record, Record)
    references = _references(reference, records, several=several)
    n_u, n_y, n_r = len(records[0].input_names), len(records[0].output_names), references[0].shape[1]
    _check_sizes(n_u, n_y, n_r, inverse)
    names = [f"reference[{i}]" for i in range(n_r)]
    check_excitation(references, names, where="reference")
    basis = LocalBasis(half_width=half_width, degree=degree, n_samples=max(len(r) for r in records))
    pairs = zip(records, references, strict=True)
    spectra = [spectrum_of(ref, np.hstack([r.outputs, r.inputs])) for r, ref in pairs]
    rounding = rounding_of([np.hstack([r.outputs, r.inputs]) for r in records])
    both = _Both(LocalEstimate(spectra, basis), n_y)
    quotient = _matrix(both) if inverse == "matrix" else _elementwise(both)
    frequencies = np.arange(1, both.estimate.n_bins + 1) / (basis.n_samples * records[0].sample_time)
    undetermined_inputs(both.found.response, frequencies, names)
    return FrequencyResponse(
        frequencies=frequencies,
        response=quotient.response,
        covariance=quotient.covariance,
        gram=quotient.gram,
        noise_covariance=quotient.noise,
        degrees_of_freedom=both.found.degrees_of_freedom,
        transient=lambda bins: both.transient(quotient.response, bins, inverse),
        suspect=quotient.singular
        | suspect_bins(both.found.variance, both.found.degrees_of_freedom, half_width, rounding),
        ratio_uncertainty=quotient.ratio_uncertainty,
        input_names=records[0].input_names,
        output_names=records[0].output_names,
        operating_point=mean_inputs(records),
        sample_time=records[0].sample_time,
        n_samples=basis.n_samples,
        method=f"closed_loop, inverse {inverse}, degree {degree}, half_width {half_width}",
        half_width=half_width,
        notes=_notes(quotient.singular, frequencies),
    )


def _references(reference: Any, records: Sequence[Record], *, several: bool) -> list[Array]:
    given = list(reference) if several and isinstance(reference, (list, tuple)) else [reference]
    if len(given) != len(records):
        raise InputError(f"{len(given)} references for {len(records)} records", where="reference", expected="one each")
    return [_checked_reference(one, record) for one, record in zip(given, records, strict=True)]


def _checked_reference(reference: Any, record: Record) -> Array:
    try:
        found = np.asarray(reference)
    except ValueError as error:
        raise InputError("reference is a ragged nest of lists", where="reference") from error
    if found.dtype.kind not in "iuf":
        raise InputError(f"reference holds {found.dtype} data", where="reference", expected="real numbers")
    found = found.astype(float)
    found = found[:, None] if found.ndim == 1 else found
    if found.ndim != 2 or found.shape[0] != len(record):
        raise InputError(
            f"reference has shape {found.shape}, the record {len(record)} samples",
            where="reference",
            expected="the same length as the record, (n, n_r)",
        )
    if not np.isfinite(found).all():
        row, column = np.argwhere(~np.isfinite(found))[0]
        raise InputError(f"reference[{row}, {column}] is not finite (nan or inf)", where="reference")
    return found


def _check_sizes(n_u: int, n_y: int, n_r: int, inverse: str) -> None:
    if n_r != n_u:
        raise InputError(
            f"reference has {n_r} columns, the plant {n_u} inputs",
            where="reference",
            expected="one external signal per plant input, so that G_ur is square",
        )
    if inverse == "elementwise" and n_y != n_u:
        raise InputError(
            f"the plant has {n_y} outputs and {n_u} inputs",
            where="inverse",
            expected="as many outputs as inputs for 'elementwise'",
            remedy="Use inverse='matrix', or record.select(outputs=[...]).",
        )


class _Both:
    """Responses from the reference to y (first) and to u."""

    def __init__(self, estimate: LocalEstimate, n_y: int):
        self.estimate, self.n_y, self.found = estimate, n_y, estimate.run()
        self.G_yr, self.G_ur = self.found.response[:n_y], self.found.response[n_y:]
        self.noise = estimate.noise(slice(None)) if self.found.noise is None else self.found.noise

    def transient(self, response: Array, bins: slice, inverse: str) -> Array:
        """y = G u + T + v: what remains of the transients of y and u."""
        both = self.estimate.transient(bins)
        T_y, T_u = both[: self.n_y], both[self.n_y :]
        if inverse == "matrix":
            return T_y - np.einsum("oif,if->of", response[..., bins], T_u)
        return T_y - np.einsum("oof,of->of", response[..., bins], T_u)


@dataclass(frozen=True)
class _Quotient:
    response: Array
    gram: Array | None
    covariance: Array | None
    noise: Array
    ratio_uncertainty: Array
    singular: Array


def _matrix(both: _Both) -> _Quotient:
    """G = G_yr G_ur^-1. Error exactly [I, -G] dG_zr G_ur^-1 with the true G, hence the Kronecker covariance."""
    G_ur, gram, n_y = both.G_ur, both.found.gram, both.n_y
    bad = np.isnan(G_ur).any(axis=(0, 1))
    left, sizes, right = np.linalg.svd(np.where(bad, 0.0, G_ur).transpose(2, 0, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = (right.conj().transpose(0, 2, 1) / sizes[:, None, :]) @ left.conj().transpose(0, 2, 1)
    inverse[bad | ~(sizes[:, -1] > 0.0)] = np.nan
    R = inverse.transpose(1, 2, 0)
    response = np.einsum("orf,rif->oif", both.G_yr, R)
    noise_u = both.noise[n_y:, n_y:]
    # u^H dG v has variance (v^T gram v*) (u^H C_u u) for the directions of the smallest singular value.
    u, v = left[:, :, -1].T, right[:, -1, :].conj().T
    spread = np.einsum("if,ijf,jf->f", v, gram, v.conj()).real * np.einsum("of,opf,pf->f", u.conj(), noise_u, u).real
    outer = np.einsum("rif,rsf,sjf->ijf", R, gram, R.conj())
    kappa = np.sqrt(np.einsum("iif->if", outer).real * np.einsum("iif->if", noise_u).real).sum(axis=0)
    return _Quotient(
        response=response,
        gram=outer,
        covariance=None,
        noise=_plant_noise(both, response),
        ratio_uncertainty=np.broadcast_to(kappa, response.shape),
        singular=_not_significant(sizes[:, -1] ** 2, spread, both),
    )


def _plant_noise(both: _Both, response: Array) -> Array:
    """Noise of y - G u: [I, -G] C_z [I, -G]^H."""
    eye = np.broadcast_to(np.eye(both.n_y)[..., None], (both.n_y, both.n_y, response.shape[2]))
    L = np.concatenate([eye, -response], axis=1)
    return np.einsum("oaf,abf,pbf->opf", L, both.noise, L.conj())


def _elementwise(both: _Both) -> _Quotient:
    """G_oi = a_oi/b_oi, error to first order (da_oi - G_oi db_oi)/b_oi."""
    a, b, gram, n = both.G_yr, both.G_ur, both.found.gram, both.n_y
    with np.errstate(divide="ignore", invalid="ignore"):
        response, one = a / b, 1.0 / b
    C_yy, C_yu, C_uu = both.noise[:n, :n], both.noise[:n, n:], both.noise[n:, n:]
    g = response
    # E[(da_oi - g_oi db_oi)(da_pj - g_pj db_pj)*], columns stacked: i outside, o inside.
    inner = (
        C_yy[None, :, None, :]
        - np.einsum("opf,pjf->ojpf", C_yu, g.conj())[None]
        - np.einsum("oif,pof->iopf", g, C_yu.conj())[:, :, None]
        + np.einsum("oif,opf,pjf->iojpf", g, C_uu, g.conj())
    )
    covariance = np.einsum("ijf,iojpf,oif,pjf->iojpf", gram, inner, one, one.conj())
    spread = np.einsum("iif,oof->oif", gram, C_uu).real
    diagonal = np.einsum("oof->of", response)
    eye = np.eye(n)[..., None]
    L = np.concatenate([np.broadcast_to(eye, (n, n, g.shape[2])), -eye * diagonal[:, None]], axis=1)
    singular = _not_significant(np.abs(np.einsum("iif->if", b)) ** 2, np.einsum("iif->if", spread), both)
    return _Quotient(
        response=response,
        gram=None,
        covariance=covariance.reshape(n * n, n * n, -1),
        noise=np.einsum("oaf,abf,pbf->opf", L, both.noise, L.conj()),
        ratio_uncertainty=np.sqrt(spread) / np.abs(b),
        singular=np.any(singular, axis=0),
    )


def _not_significant(square: Array, variance: Array, both: _Both) -> Array:
    q = np.maximum(both.found.degrees_of_freedom, 1)
    return np.logical_not(square > quantile(0.95, q) * variance)


def _notes(singular: Array, frequencies: Array) -> list[str]:
    if not singular.any():
        return []
    where = frequencies[singular]
    return [
        f"The response from reference to u is not significantly invertible in {where.size} bins between {where[0]:.3g} "
        f"and {where[-1]:.3g} Hz: the loop hides the plant there. Excite more at these frequencies, or lower the gain."
    ]
