"""Weighted rows and columns of the Jacobian over the box: methods "sum" and "max", and gains.

A line is, for given temperatures, a sum of quadratics in the currents, and affine in every temperature for given
currents: its maximum lies at ends of the temperatures. Where links are not linear their slopes are taken as independent
of the rest: an upper bound. With ``inner`` they are taken at the ends themselves: a value that the line attains.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from ._exact import ZERO, ends
from ._thermal import Form, Link, Module, Network, Quadratic, peak


class Lines:
    """The weighted lines of one network: columns c'J (method sum) or rows J d (method max)."""

    def __init__(self, network: Network, columns: bool, weights: Sequence[Fraction]):
        self.network, self.columns, self.weights = network, columns, weights
        self.links: list[list[Link]] = [[] for _ in network.lumps]
        self.modules: list[list[int]] = [[] for _ in network.lumps]
        for link in network.links:
            for lump in link.lumps:
                self.links[lump].append(link)
        for k, module in enumerate(network.modules):
            self.modules[module.hot].append(k)
            self.modules[module.cold].append(k)

    def largest(self, j: int, inner: bool) -> Fraction:
        """Return the largest weighted line of lump j [W/K times the weights]: a bound, or (inner) an attained value."""
        partners, outside = self._around(j)
        box = self.network.temperature
        best: Fraction | None = None
        for own in ends(box[j]):
            losses = (link.least_loss((own, own) if inner else box[j]) for link in outside)
            total = -self.weights[j] * sum(losses, ZERO)
            for p, (links, modules) in partners.items():
                total += max(self._links(j, p, links, own, other, sign * self.weights[p], inner)
                             + self._modules(j, p, modules, own, other, sign * self.weights[p])
                             for other in ends(box[p]) for sign in (1, -1))
            best = total if best is None or total > best else best
        if best is None:
            raise ValueError("an interval has at least one end")
        return best

    def _around(self, j: int) -> tuple[dict[int, tuple[list[Link], list[int]]], list[Link]]:
        """Return links and modules to every partner of lump j, and its links to ambients."""
        partners: dict[int, tuple[list[Link], list[int]]] = {}
        outside = []
        for link in self.links[j]:
            other = next((p for p in link.lumps if p != j), None)
            if other is None:
                outside.append(link)
            else:
                partners.setdefault(other, ([], []))[0].append(link)
        for k in self.modules[j]:
            module = self.network.modules[k]
            partners.setdefault(module.cold if module.hot == j else module.hot, ([], []))[1].append(k)
        return partners, outside

    def _links(self, j: int, p: int, links: list[Link], own: Fraction, other: Fraction, v: Fraction,
               inner: bool) -> Fraction:
        """Return the share of the links to one partner, whose weight v has the sign the entry is taken with."""
        w, total, box = self.weights[j], ZERO, self.network.temperature
        here, there = ((own, own), (other, other)) if inner else (box[j], box[p])
        for link in links:
            total += max((v - w) * slope for slope in link.exchange(here, there, inner))
            if self.columns:  # row p of column j holds the slope at j too
                total += max((v - w) * slope for slope in link.emission(here))
            elif inner:  # one coefficient for both ends
                total += max(4 * c * (v * other**3 - w * own**3) for c in link.radiation)
            else:
                total += max(-w * slope for slope in link.emission(here))
                total += max(v * slope for slope in link.emission(there))
        return total

    def _modules(self, j: int, p: int, modules: list[int], own: Fraction, other: Fraction, v: Fraction) -> Fraction:
        total = ZERO
        for k in modules:
            module = self.network.modules[k]
            total += max(peak(self._share(module, form, j, p, own, other, v), self.network.current[k])
                         for form in module.forms)
        return total

    def _share(self, module: Module, form: Form, j: int, p: int, own: Fraction, other: Fraction,
               v: Fraction) -> Quadratic:
        """Return w_j J_jj + v J_pj (columns) or v J_jp (rows) of one module."""
        entries = module.jacobian(form, own, other) if module.hot == j else module.jacobian(form, other, own)
        beside = entries[(p, j) if self.columns else (j, p)]
        a, b, c = (self.weights[j] * x + v * y for x, y in zip(entries[j, j], beside, strict=True))
        return a, b, c
