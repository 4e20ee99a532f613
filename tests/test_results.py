"""Every public result can be pickled, copied and, where it draws itself, drawn into axes of the caller."""

from __future__ import annotations

import copy
import inspect
import pickle
from dataclasses import fields, is_dataclass
from typing import Any

import control
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from figures import complaints
from pydantic import BaseModel
from results import instances, public_classes

import robthermal as rt

pytestmark = pytest.mark.exhaustive  # what is made here is made by the tests of each package too
# Made by no short example; each of the same kind as others that are here, or made of nothing but what is.
ELSEWHERE = {"calibration.Estimates", "diagnosis.Measurement", "diagnosis.Response", "diagnosis.Decision",
             "diagnosis.JointCheck", "design.CertifiedLoop", "design.Polarity", "coupling.Joint", "coupling.Norm",
             "diagnosis.Left", "diagnosis.Remainder"}
CLASSES = public_classes()
DRAWN = [(one, name) for one in CLASSES for name in dir(one) if name == "plot" or name.startswith("plot_")]


def same(one: Any, other: Any) -> bool:
    """Whether two objects have the same content."""
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=one.dtype.kind in "fc")
    if isinstance(one, pd.DataFrame):
        return one.equals(other)
    if isinstance(one, control.StateSpace):
        return one.dt == other.dt and one.input_labels == other.input_labels and all(
            np.array_equal(getattr(one, key), getattr(other, key)) for key in "ABCD")
    if isinstance(one, dict):
        return list(one) == list(other) and all(same(one[key], other[key]) for key in one)
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    if is_dataclass(one):
        return type(one) is type(other) and all(
            same(getattr(one, field.name), getattr(other, field.name)) for field in fields(one)
            if not field.name.startswith("_"))
    if isinstance(one, BaseModel | str | float | int | type(None)):
        return bool(one == other or one != one and other != other)
    return type(one) is type(other)


def test_nearly_every_class_is_made() -> None:
    made = instances()
    missing = {name for one, name in CLASSES.items() if one not in made and not issubclass(one, BaseModel)}
    assert missing == ELSEWHERE, "name an example that makes it in tests/results.py"
    assert len(made) > 100


@pytest.mark.parametrize("kind", [one for one in CLASSES if not issubclass(one, BaseModel)], ids=CLASSES.get)
def test_results_are_pickled_and_copied(kind: type) -> None:
    found = instances().get(kind, [])[:2]
    assert found or CLASSES[kind] in ELSEWHERE
    for one in found:
        if isinstance(one, rt.diagnosis.Effect) and one.name not in rt.thermal.effects():
            with pytest.raises((pickle.PicklingError, AttributeError)):  # of a user, with functions of the moment
                pickle.dumps(one)
            continue
        assert same(pickle.loads(pickle.dumps(one)), one)
        assert same(copy.deepcopy(one), one) and same(copy.copy(one), one)


def test_results_are_frozen() -> None:
    open_ = [CLASSES[one] for one in CLASSES if is_dataclass(one) and not one.__dataclass_params__.frozen]  # type: ignore[attr-defined]
    assert open_ == []


def test_content_that_differs_is_seen() -> None:
    record = next(one for one in instances()[rt.Record] if one.outputs.size)
    assert not same(record, record.with_outputs(record.outputs + 1.0))


@pytest.mark.parametrize(("kind", "method"), DRAWN, ids=lambda value: CLASSES.get(value, value))
def test_what_draws_into_one_axes_takes_it(kind: type, method: str) -> None:
    """Return annotations tell: an array of axes makes its own figure, anything else is drawn into `ax`."""
    told = inspect.signature(getattr(kind, method))
    if str(told.return_annotation).startswith("NDArray"):
        assert "ax" not in told.parameters
        return
    assert told.parameters["ax"].default is None
    found = instances().get(kind, [])[:1]
    assert found or CLASSES[kind] in ELSEWHERE
    needed = [one for one in told.parameters.values() if one.default is one.empty and one.name != "self"]
    for plot in [getattr(one, method) for one in found if not needed]:
        figure, (first, second) = plt.subplots(1, 2)
        assert plot(ax=second) is second
        assert second.has_data() and not first.has_data()
        assert plt.get_fignums() == [figure.number]
        assert plot() is not second
        with pytest.raises(rt.InputError, match="argument ax.*one matplotlib axes"):
            plot(ax=np.array([first, second]))


@pytest.mark.parametrize(("kind", "method"), DRAWN, ids=lambda value: CLASSES.get(value, value))
def test_figures_can_be_read(kind: type, method: str) -> None:
    """No text over text or cut off, a quantity with its unit at every axis, a name for every one of several curves."""
    found = instances().get(kind, [])[:1]
    assert found or CLASSES[kind] in ELSEWHERE
    for one in found:
        needed = [one.loops[0]] if method == "plot_bode" or method == "plot_nyquist" else []
        assert complaints(np.ravel(getattr(one, method)(*needed))[0].figure) == []
        plt.close("all")


def test_what_cannot_be_read_is_complained_of() -> None:
    figure, (left, right) = plt.subplots(1, 2)
    left.plot([0, 1], [0, 1], label="one")
    left.plot([0, 1], [1, 0], label="other")
    left.text(0.5, 0.5, "first")
    left.text(0.5, 0.5, "second")
    right.bar(["a", "b"], [1.0, 2.0])
    right.set(ylabel="heat [W]", title="far too long for a figure of this width, and therefore cut off")
    said = " ".join(complaints(figure))
    assert all(part in said for part in ("'first' lies on 'second'", "x axis says ''", "y axis says ''", "no legend",
                                         "is cut off by the edge"))
    left.set(xlabel="time [s]", ylabel="current [A]")
    left.legend()
    left.texts[1].set_visible(False)
    right.set_title("")
    assert complaints(figure) == []
    left.set_ylabel("current")
    assert complaints(figure) == ["y axis says 'current': no quantity with its unit in brackets"]


@pytest.mark.parametrize("kind", [rt.System, rt.Record, rt.calibration.Fit, rt.identify.FrequencyResponse,
                                  rt.Certificate, rt.diagnosis.Diagnosis])
def test_notebooks_show_a_short_table(kind: type) -> None:
    shown = instances()[kind][0]._repr_html_()
    assert shown.count("<") == shown.count(">") and len(shown) < 20_000
    assert (shown.startswith("<table><caption>") and "<td>" in shown) != (kind is rt.Certificate)


def test_names_of_the_user_are_escaped() -> None:
    name = "<script>alert(1)</script>"
    system = rt.System(name=name, ambients={"room": {"temperature": 300.0}}, lumps={"bar": {"capacity": 1.0}},
                       links=[{"between": ("bar", "room"), "conductance": 1.0}])
    record = rt.Record(sample_time=1.0, inputs=np.zeros(3), outputs=np.zeros(3), input_names=["q"], output_names=["T"],
                       name=name)
    for one in (system, record):
        assert "<script" not in one._repr_html_() and "&lt;script&gt;" in one._repr_html_()


def test_a_certificate_that_does_not_hold_says_so_in_a_notebook() -> None:
    system = rt.systems.two_module()
    currents = {"m1": (0.0, 60.0), "m2": (0.0, 60.0)}
    refused = rt.certify.contraction(system, current=currents, temperature=(278.15, 358.15))
    assert not refused.holds and "does not hold" in refused._repr_html_()
