"""Lower bound of the structured singular value: a perturbation that makes I − M Delta singular, for many frequencies.

mu = max rho(M Delta) over the Delta of the structure with sigma_max <= 1 (Doyle, 1982). Any such Delta gives a lower
bound and, divided by its eigenvalue, a perturbation that proves it. Candidates come from the power iteration of
Packard, Fan and Doyle (1988), started where the upper bound's dual matrix points; eigenvectors climb what is left.
"""

from __future__ import annotations

import numpy as np

from ._blocks import Complex, Real, Structure

_STARTS = 5
_MORE_STARTS = 24
_SWEEPS = 24
_MORE_SWEEPS = 60
_CLIMBERS = 6
_MEMORY = 4_000_000  # complex numbers held at once
_CLIMBS = 40
_MET = 2e-4  # relative gap to the upper bound at which the search ends
_STEPS = np.array([1.0, 0.5, 0.2, 0.05])
_TINY = 1e-150  # its square is still a normal number


def worst_perturbation(M: Complex, structure: Structure, upper: Real, dual: Complex) -> tuple[Real, Complex]:
    """Find the largest rho(M Delta) and its Delta.

    Parameters
    ----------
    M : ndarray, shape (n_f, p, m)
        Matrices of all frequencies.
    structure : Structure
        Blocks of Delta.
    upper : ndarray, shape (n_f,)
        Upper bounds, to know when to stop.
    dual : ndarray, shape (n_f, m, m)
        Where to start.

    Returns
    -------
    lower : ndarray, shape (n_f,)
        |eigenvalue| of M Delta.
    delta : ndarray, shape (n_f, m, p)
        det(I − M delta) = 0, sigma_max(delta) = 1/lower; nan where lower is 0.
    """
    step = max(1, _MEMORY // (2 * _MORE_STARTS * M.shape[1] * M.shape[2]))
    parts = [_worst(M[k:k + step], structure, upper[k:k + step], dual[k:k + step]) for k in range(0, len(M), step)]
    lower, delta = zip(*parts, strict=True)
    return np.concatenate(lower), np.concatenate(delta)


def _worst(M: Complex, structure: Structure, upper: Real, dual: Complex) -> tuple[Real, Complex]:
    random = np.random.default_rng(5)
    lower, Delta = _best(M, _iterate(M, structure, _starts(dual, _STARTS, random), _SWEEPS))
    for more in (False, True):
        far = np.flatnonzero(lower < (1 - _MET) * upper)
        if len(far):
            tried = Delta[far][:, None]
            if more:
                tried = np.concatenate([tried, _others(M[far], structure, dual[far], random)], axis=1)
            lower[far], Delta[far] = _best(M[far], _climb(M[far], structure, tried, upper[far]))
    return lower, _singular(M, Delta, lower)


def _others(M: Complex, structure: Structure, dual: Complex, random: np.random.Generator) -> Complex:
    """The best few of many more candidates, half of them from anywhere."""
    anywhere = np.tile(np.eye(M.shape[2], dtype=complex), (len(M), 1, 1))
    starts = np.concatenate([_starts(Z, _MORE_STARTS, random) for Z in (dual, anywhere)], axis=1)
    found = _iterate(M, structure, starts, _MORE_SWEEPS)
    few = np.argsort(-_radius(M[:, None] @ found), axis=1)[:, :_CLIMBERS]
    return np.take_along_axis(found, few[:, :, None, None], axis=1)


def _starts(Z: Complex, count: int, random: np.random.Generator) -> Complex:
    """Inputs (n_f, count, m): the main direction of Z, then random ones of covariance Z."""
    s, U = np.linalg.eigh(Z)
    root = U * np.sqrt(np.maximum(s, 0.0) / np.maximum(s[:, -1:], _TINY))[:, None, :]
    m = Z.shape[1]
    noise: Complex = random.normal(size=(len(Z), m, count)) + 1j * random.normal(size=(len(Z), m, count))
    noise[:, :, 0] = np.eye(m)[-1]
    return (root @ noise).mT


def _iterate(M: Complex, structure: Structure, b: Complex, sweeps: int) -> Complex:
    """Power iteration of Packard, Fan and Doyle from the inputs b (n_f, s, m): candidates Delta (n_f, s, m, p)."""
    forward, backward = M.mT, M.conj()  # rows of a stack of vectors: a = M b, w = Mᴴ z
    w = b
    for _ in range(sweeps):
        a = _unit(b @ forward)
        z = _aligned(structure, a, w, inputs=False)
        w = _unit(z @ backward)
        b = _aligned(structure, a, w, inputs=True)
    return _perturbation(structure, a, w)


def _aligned(structure: Structure, a: Complex, w: Complex, *, inputs: bool) -> Complex:
    """b = Delta a (inputs) or z = Deltaᴴ w (outputs) of the Delta that `a` and `w` define, block by block."""
    out = np.empty_like(w if inputs else a)
    for block in structure.blocks:
        a_i, w_i = a[..., block.columns], w[..., block.rows]
        if block.repeated:
            phase = _phase((a_i.conj() * w_i).sum(-1, keepdims=True))
            if inputs:
                out[..., block.rows] = phase * a_i
            else:
                out[..., block.columns] = phase.conj() * w_i
        else:
            if inputs:
                out[..., block.rows] = _size(a_i) * _unit(w_i)
            else:
                out[..., block.columns] = _size(w_i) * _unit(a_i)
    return out


def _perturbation(structure: Structure, a: Complex, w: Complex) -> Complex:
    """Delta of the structure with blocks of size one that turn `a` to `w` as far as they can."""
    m, p = structure.shape
    Delta = np.zeros((*a.shape[:-1], m, p), complex)
    for block in structure.blocks:
        a_i, w_i = a[..., block.columns], w[..., block.rows]
        if block.repeated:
            phase = _phase((a_i.conj() * w_i).sum(-1))[..., None, None]
            Delta[..., block.rows, block.columns] = phase * np.eye(block.shape[0])
        else:
            Delta[..., block.rows, block.columns] = _unit(w_i)[..., :, None] * _unit(a_i).conj()[..., None, :]
    return Delta


def _climb(M: Complex, structure: Structure, Delta: Complex, upper: Real) -> Complex:
    """Raise rho(M Delta) monotonically: towards the Delta its eigenvectors ask for, by the best of a few steps."""
    rho, todo = _radius(M[:, None] @ Delta), np.arange(len(M))
    for _ in range(_CLIMBS):
        a, w = _eigenvectors(M[todo][:, None] @ Delta[todo])
        goal = _perturbation(structure, a, w @ M[todo].conj())
        steps = _STEPS[:, None, None]
        tried = _normalized(structure, Delta[todo][:, :, None] + steps * (goal - Delta[todo])[:, :, None])
        found = _radius(M[todo][:, None, None] @ tried)
        which = found.argmax(2)
        new = np.take_along_axis(found, which[:, :, None], 2)[:, :, 0]
        better = new > rho[todo]
        chosen = np.take_along_axis(tried, which[:, :, None, None, None], 2)[:, :, 0]
        Delta[todo] = np.where(better[:, :, None, None], chosen, Delta[todo])
        gained = np.where(better, new / np.maximum(rho[todo], _TINY) - 1, 0.0).max(1)
        rho[todo] = np.maximum(rho[todo], new)
        todo = todo[(gained > 1e-7) & (rho[todo].max(1) < (1 - 0.1 * _MET) * upper[todo])]
        if not len(todo):
            break
    return Delta


def _normalized(structure: Structure, Delta: Complex) -> Complex:
    """Blocks divided by their norms: |eigenvalue| may only grow with each of them at a maximum."""
    out = np.zeros_like(Delta)
    for block in structure.blocks:
        part = Delta[..., block.rows, block.columns]
        size = np.linalg.norm(part, 2, axis=(-2, -1))[..., None, None]
        out[..., block.rows, block.columns] = part / np.maximum(size, _TINY)
    return out


def _eigenvectors(A: Complex) -> tuple[Complex, Complex]:
    """Right and left eigenvector of the largest |eigenvalue|, with wᴴ A a / wᴴ a > 0 turned into w."""
    values, right = np.linalg.eig(A)
    left = np.linalg.pinv(right).mT.conj()
    top = np.abs(values).argmax(-1)[..., None]
    value = np.take_along_axis(values, top, -1)
    a = np.take_along_axis(right, top[..., None], -1)[..., 0]
    w = np.take_along_axis(left, top[..., None], -1)[..., 0]
    inner = (w.conj() * a).sum(-1, keepdims=True)
    return a, w * _phase(value) * _phase(inner)


def _best(M: Complex, Delta: Complex) -> tuple[Real, Complex]:
    rho = _radius(M[:, None] @ Delta)
    top = rho.argmax(1)
    chosen = np.arange(len(M))
    return rho[chosen, top], Delta[chosen, top]


def _singular(M: Complex, Delta: Complex, lower: Real) -> Complex:
    """Delta / eigenvalue: M delta then has the eigenvalue 1."""
    values = np.linalg.eigvals(M @ Delta)
    top = np.take_along_axis(values, np.abs(values).argmax(1)[:, None], 1)[:, :, None]
    return np.where(lower[:, None, None] > 0, Delta / np.where(top == 0, 1.0, top), np.nan)


def _radius(A: Complex) -> Real:
    return np.abs(np.linalg.eigvals(A)).max(-1)


def _size(v: Complex) -> Real:
    return np.sqrt((v.real**2 + v.imag**2).sum(-1, keepdims=True))


def _unit(v: Complex) -> Complex:
    size = _size(v)  # below the smallest normal number its own rounding spoils the quotient: call that zero
    return np.where(size > _TINY, v / np.where(size > _TINY, size, 1.0), 0.0)


def _phase(value: Complex) -> Complex:
    size = np.abs(value)
    return np.where(size > _TINY, value / np.where(size > _TINY, size, 1.0), 1.0)
