"""A certificate as authority: only after it was proven again, and only for the machine it is about."""

from __future__ import annotations

from ..errors import InputError
from ..thermal import System
from ..verification import Certificate, machine_hash, same_system, verify
from ._own_heat import driven
from ._sections import system_section


def check_certificate(certificate: Certificate, system: System, kind: str, where: str = "argument certificate") -> None:
    """Refuse a certificate that cannot be relied on for a machine: it is proven again, and its system compared exactly.

    Parameters
    ----------
    certificate : Certificate
        From a file or just made; nothing it says of itself is believed.
    system : System
        Machine that is to rely on it.
    kind : str
        Kind of claim that is needed.
    where : str
        Argument or file that is named in the message.

    Raises
    ------
    InputError
        No certificate, another kind, one that is not proven, or one of another machine.

    Examples
    --------
    >>> import robthermal as rt
    >>> system = rt.systems.two_module()
    >>> box = {"m1": (-1.0, 1.5), "m2": (-1.0, 1.5)}
    >>> cert = rt.certify.contraction(system, current=box, temperature=(278.15, 358.15), method="sum")
    >>> rt.certify.check_certificate(cert, system, "contraction")
    >>> rt.certify.check_certificate(cert, system.with_parameters({"lumps.x1.capacity": 41.0}), "contraction")
    Traceback (most recent call last):
    ...
    robthermal.errors.InputError: argument certificate: the certificate is about another machine, ...
    """
    if not isinstance(certificate, Certificate) or certificate.kind != kind or not certificate.holds:
        raise InputError(f"this is not a {kind} certificate that holds", where=where,
                         expected=f"a Certificate of kind {kind!r} with .holds True")
    verdict = verify(certificate)
    if not verdict.valid:
        raise InputError(f"the certificate is not valid: {verdict.reason}", where=where,
                         expected="a certificate that rt.verify proves", remedy="Make it again from the machine.")
    following = tuple(name for name in certificate.system.get("inputs", {}) if name in system.inputs)
    section = system_section(system, forcing=True, heaters=following)
    if not same_system(certificate, section):
        raise InputError(f"the certificate is about another machine, {machine_hash(certificate.system)} instead of "
                         f"{machine_hash(section)}", where=where, expected="a certificate of exactly this system",
                         remedy="Certify this system; any changed number makes it another machine.")
    if kind == "invariance":
        _cover(certificate, system, where)


def _cover(certificate: Certificate, system: System, where: str) -> None:
    """Refuse heats of the system's own, constant and of leads, that are not among those of a box that is never left."""
    current = {name: (float(low), float(high)) for name, (low, high) in certificate.region["current"].items()}
    covered = certificate.region.get("heat", {})
    for lump, (low, high) in driven(system, {}, None, current).heat.items():
        least, most = (float(end) for end in covered.get(lump, (0.0, 0.0)))
        if low < least or high > most:
            raise InputError(f"the system itself heats lump {lump!r} by {low:.6g} to {high:.6g} W, and the box is "
                             f"never left for {least:.6g} to {most:.6g} W", where=where,
                             expected="a certificate of exactly this system", remedy="Certify this system.")
