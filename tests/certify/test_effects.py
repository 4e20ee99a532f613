"""Physics that no certificate covers must be refused, not left out: the certificate would be about another machine."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import robthermal as rt
from robthermal.errors import InputError
from robthermal.thermal import Equations

BOX = {"m1": (0.0, 1.0), "m2": (0.0, 1.0)}
SPAN = (278.15, 358.15)


def with_effect(**changes):
    data = rt.systems.two_module().model_dump()
    for table, parts in changes.items():
        if table == "leads":
            data[table] = parts
        else:
            for name, values in parts.items():
                key = next(k for k, link in enumerate(data[table]) if link["name"] == name) if table == "links" else name
                data[table][key] = {**data[table][key], **values}
    return rt.System(**data)


EFFECTS = [{"modules": {"m1": {"thomson": 5.0}}}, {"modules": {"m1": {"joule_split": 0.3}}},
           {"modules": {"m1": {"drive": {"gain": 0.5}}}}, {"lumps": {"x1": {"heat": 1.0}}},
           {"lumps": {"x1": {"condensation": {"conductance": 1.0, "dew_point": 290.0}}}},
           {"leads": [{"module": "m1", "lump": "x1", "resistance": 2.0}]}]
CALLS = {"contraction": lambda s: rt.certify.contraction(s, current=BOX, temperature=SPAN),
         "invariance": lambda s: rt.certify.invariance(s, current=BOX, temperature=SPAN),
         "observer": lambda s: rt.certify.observer(s, gain=np.zeros((18, 1)), sensors=["T6"], current=BOX,
                                                   temperature=SPAN)}


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: next(iter(effect)))
@pytest.mark.parametrize("call", CALLS)
def test_effects_are_refused_by_name(effect, call):
    system = with_effect(**effect)
    assert len(system.effects) == 1
    with pytest.raises(InputError, match=system.effects[0]):
        CALLS[call](system)


def test_the_thomson_effect_that_was_once_left_out_makes_the_box_unstable():
    system = with_effect(modules={"m1": {"thomson": 5.0}})
    equations, rng, worst = Equations(system), np.random.default_rng(0), -np.inf
    u = np.zeros(len(system.exogenous_names))
    u[-len(system.ambients):] = 298.15
    for k, _ in itertools.product(range(2), range(10)):
        u[system.exogenous_names.index("m1")] = k
        J = equations.jacobian(rng.choice(SPAN, 18), u)
        worst = max(worst, np.linalg.eigvals(J.toarray() / equations.capacity[:, None]).real.max())
    assert worst > 0
