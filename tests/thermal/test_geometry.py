"""Rods and stacks against closed forms of heat conduction."""

from __future__ import annotations

import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

import robthermal as rt
from robthermal.thermal import Assembly, Contact, Layer, Material, System

STUFF = Material("test metal", conductivity=20.0, density=8000.0, specific_heat=500.0)
LENGTH, AREA, PERIMETER, FILM = 0.2, 1e-4, 0.04, 12.0


def network(system: System) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Capacities, conductance matrix A, and conductances to each ambient, straight from the links."""
    at = {name: i for i, name in enumerate((*system.lumps, *system.ambients))}
    n = len(system.lumps)
    full = np.zeros((len(at), len(at)))
    for link in system.links:
        i, j = (at[end] for end in link.between)
        full[i, j] += link.conductance
        full[j, i] += link.conductance
    A = full[:n, :n] - np.diag(full[:n].sum(axis=1))
    return np.array([lump.capacity for lump in system.lumps.values()]), A, full[:n, n:]


def steady(system: System) -> np.ndarray:
    """Temperatures at rest without heaters."""
    _, A, B = network(system)
    return np.linalg.solve(A, -B @ [ambient.temperature for ambient in system.ambients.values()])


def centers(n: int, length: float = LENGTH) -> np.ndarray:
    return (np.arange(n) + 0.5) * length / n


def orders(errors: list[float]) -> np.ndarray:
    """Observed order of convergence between halvings of the lump length."""
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


def fin(n: int) -> System:
    a = Assembly()
    a.ambient("base", 350.0)
    a.ambient("room", 300.0)
    bar = a.rod("bar", length=LENGTH, area=AREA, material=STUFF, lumps=n, perimeter=PERIMETER, convection=FILM,
                ambient="room")
    a.join("base", bar[0])
    return a.system()


def test_fin_with_insulated_tip_converges_with_second_order() -> None:
    """θ/θ_b = cosh(m (L - x))/cosh(m L), m² = h P/(k A); base heat √(h P k A) θ_b tanh(m L)."""
    m = np.sqrt(FILM * PERIMETER / (20.0 * AREA))
    errors, heats = [], []
    for n in (8, 16, 32, 64):
        T = steady(fin(n))
        exact = 300.0 + 50.0 * np.cosh(m * (LENGTH - centers(n))) / np.cosh(m * LENGTH)
        errors.append(np.abs(T - exact).max())
        base = next(link for link in fin(n).links if "base" in link.between)
        exact_heat = np.sqrt(FILM * PERIMETER * 20.0 * AREA) * 50.0 * np.tanh(m * LENGTH)
        heats.append(abs(base.conductance * (350.0 - T[0]) - exact_heat))
    assert orders(errors) == pytest.approx(2.0, abs=0.25)
    assert orders(heats) == pytest.approx(2.0, abs=0.25)
    assert errors[-1] < 0.02


def test_eigenvalues_between_fixed_ends_converge_with_second_order() -> None:
    """λ_j = (k/ρc)(j π/L)²."""
    diffusivity = 20.0 / (8000.0 * 500.0)
    exact = diffusivity * (np.arange(1, 4) * np.pi / LENGTH) ** 2
    errors = []
    for n in (10, 20, 40):
        a = Assembly()
        a.ambient("bath", 300.0)
        bar = a.rod("bar", length=LENGTH, area=AREA, material=STUFF, lumps=n)
        a.join("bath", bar[0])
        a.join(bar[-1], "bath")
        E, A, _ = network(a.system())
        errors.append(np.abs(eigh(-A, np.diag(E), eigvals_only=True)[:3] / exact - 1).max())
    assert orders(errors) == pytest.approx(2.0, abs=0.1)
    assert errors[-1] < 0.006


def test_eigenvalues_of_an_insulated_rod_with_side_convection_are_exact() -> None:
    """Equal lumps: λ_j = (4 k/(ρ c Δx²)) sin²(j π/2n) + h P/(ρ c A), to rounding."""
    n, heat = 12, 8000.0 * 500.0
    a = Assembly()
    a.ambient("room", 300.0)
    a.rod("bar", length=LENGTH, area=AREA, material=STUFF, lumps=n, perimeter=PERIMETER, convection=FILM,
          ambient="room")
    E, A, _ = network(a.system())
    exact = 4 * 20.0 / (heat * (LENGTH / n) ** 2) * np.sin(np.arange(n) * np.pi / (2 * n)) ** 2
    exact += FILM * PERIMETER / (heat * AREA)
    np.testing.assert_allclose(eigh(-A, np.diag(E), eigvals_only=True), exact, rtol=1e-11)
    assert E.sum() == pytest.approx(heat * AREA * LENGTH, rel=1e-13)


@pytest.mark.parametrize("lumps", [1, 3, 7])
def test_composite_wall_is_exact_for_any_cut(lumps: int) -> None:
    """q = ΔT/(Σ L/(k A) + Σ Rc/A + 1/(h A)): without storage the halves in series are exact."""
    a = Assembly()
    a.ambient("hot", 400.0)
    a.ambient("air", 300.0)
    wall = a.stack([Layer("steel", 0.02, STUFF, lumps), Contact(2e-4), Layer("pad", 0.005, "POM", lumps),
                    Layer("cap", 0.003, "copper")], area=2e-3)
    a.join("hot", wall[0], contact_resistance=1e-4)
    a.join(wall[-1], "air", convection=80.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        system = a.system()
    T = steady(system)
    k = rt.thermal.materials()["conductivity"]
    per_area = 1e-4 + 0.02 / 20.0 + 2e-4 + 0.005 / k["POM"] + 0.003 / k["copper"] + 1 / 80.0
    out = next(link for link in system.links if link.between == (wall[-1], "air"))
    assert out.conductance * (T[-1] - 300.0) == pytest.approx(100.0 * 2e-3 / per_area, rel=1e-12)
    slope = (20.0 * 2e-3) / 0.02 * lumps  # of the steel, between neighboring centers [W/K]
    if lumps > 1:
        np.testing.assert_allclose(slope * -np.diff(T[:lumps]), 100.0 * 2e-3 / per_area, rtol=1e-10)


def test_lumps_of_the_stack_are_named_and_weighed() -> None:
    a = Assembly()
    a.ambient("room", 300.0)
    wall = a.stack([Layer("steel", 0.02, STUFF, 2), Layer("cap", 0.003, "copper")], area=2e-3)
    a.join(wall[0], "room", contact_resistance=1e-3)
    assert wall == ("steel1", "steel2", "cap1")
    assert a.system().parameter("lumps.cap1.capacity") == pytest.approx(8933.0 * 385.0 * 0.003 * 2e-3)


def test_given_lumps_join_rods_and_each_other() -> None:
    a = Assembly()
    a.ambient("room", 300.0)
    block, plate = a.lump("block", 40.0), a.lump("plate", 20.0)
    bar = a.rod("bar", length=0.1, area=AREA, material=STUFF, lumps=2)
    a.join(block, bar[0], contact_resistance=1e-4)
    a.join(block, plate, contact_resistance=5e-5, area=2e-3)
    a.join(plate, "room", convection=25.0, area=4e-3)
    system = a.system(name="bench", inputs={"Q": {"lump": "block"}}, links=[{"between": ("bar2", "room"),
                                                                             "conductance": 0.01}])
    assert system.parameter("links.block-bar1.conductance") == pytest.approx(1 / (0.025 / (20 * AREA) + 1e-4 / AREA))
    assert system.parameter("links.block-plate.conductance") == pytest.approx(2e-3 / 5e-5)
    assert system.parameter("links.plate-room.conductance") == pytest.approx(25.0 * 4e-3)
    assert system.parameter("links.bar2-room.conductance") == 0.01
    assert system.name == "bench" and system.input_names == ("Q",)


def biot_rod(lumps: int, **options) -> Assembly:
    a = Assembly()
    a.ambient("room", 300.0)
    a.rod("bar", length=0.1, area=AREA, material="POM", lumps=lumps, ambient="room", **options)
    return a


def test_biot_numbers_by_hand() -> None:
    """Along: Δx/(2 k A) times films h P Δx (and 1/(1/(h A)) at an end); across: h (A/P)/k."""
    a = biot_rod(5, perimeter=0.04, convection=10.0)
    a.join("bar5", "room", convection=20.0)
    a.lump("block", 10.0)
    table, dx, k = a.biot(), 0.02, 0.31
    half = dx / (2 * k * AREA)
    assert table.loc["bar1", "along"] == pytest.approx(half * 10.0 * 0.04 * dx)
    assert table.loc["bar5", "along"] == pytest.approx(half * (10.0 * 0.04 * dx + 20.0 * AREA))
    assert table.loc["bar3", "across"] == pytest.approx(10.0 * (AREA / 0.04) / k)
    np.testing.assert_array_equal(table["biot"].iloc[:5], table[["along", "across"]].max(axis=1).iloc[:5])
    assert table.loc["block"].isna().all()


def test_more_lumps_lower_the_biot_number_along_with_the_square() -> None:
    coarse, fine = (biot_rod(n, perimeter=0.04, convection=10.0).biot()["along"].max() for n in (5, 10))
    assert coarse / fine == pytest.approx(4.0)


def test_warning_names_lumps_and_remedy() -> None:
    expected = r"along above 0\.1: bar1 \(.*and 1 more\. Remedy: cut the body into more"
    with pytest.warns(UserWarning, match=expected) as seen:
        biot_rod(6, perimeter=0.04, convection=10.0).system()
    assert len(seen) == 1 and seen[0].filename == __file__
    with pytest.warns(UserWarning, match=r"across above 0\.1.*two dimensions"):
        biot_rod(100, perimeter=0.04, convection=20.0).system()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        biot_rod(60, perimeter=0.04, convection=5.0).system()


@pytest.mark.parametrize(("options", "message"), [
    ({"length": 0.0}, r"rod 'bar' length.*positive number"),
    ({"area": -1e-4}, r"rod 'bar' area.*positive number"),
    ({"lumps": 2.5}, r"rod 'bar' lumps.*whole number"),
    ({"lumps": 0}, r"rod 'bar' lumps.*whole number"),
    ({"material": "aluminum"}, r"'aluminum' is not in the table.*Did you mean 'aluminium'"),
    ({"material": 7}, r"rod 'bar' material.*7 is not in the table"),
    ({"convection": 5.0}, r"convection without a perimeter.*Give perimeter"),
    ({"convection": 5.0, "perimeter": 0.04, "ambient": "rom"}, r"ambient 'rom' does not exist.*Assembly\.ambient"),
    ({"convection": 5.0, "perimeter": 0.04}, r"ambient None does not exist"),
    ({"perimeter": float("nan")}, r"rod 'bar' perimeter.*not (a number|finite)"),
])
def test_bad_rods_are_refused(options: dict, message: str) -> None:
    a = Assembly()
    a.ambient("room", 300.0)
    with pytest.raises(rt.InputError, match=message):
        a.rod("bar", **{"length": 0.1, "area": AREA, "material": STUFF, **options})


def assembled() -> Assembly:
    a = Assembly()
    a.ambient("room", 300.0)
    a.rod("bar", length=0.1, area=AREA, material=STUFF, lumps=3)
    a.lump("block", 10.0)
    a.lump("plate", 10.0)
    return a


@pytest.mark.parametrize(("call", "message"), [
    (lambda a: a.join("bar2", "room"), r"'bar2' has no free end face.*links of Assembly\.system"),
    (lambda a: [a.join("bar1", "room"), a.join("bar1", "block")], r"'bar1' has no free end face"),
    (lambda a: a.join("bar", "room"), r"'bar' does not exist.*name1, name2"),
    (lambda a: a.join("room", "room"), r"joins no two bodies"),
    (lambda a: a.join("bar1", "bar1"), r"joins no two bodies"),
    (lambda a: a.join("block", "plate"), r"has no resistance.*Give contact_resistance"),
    (lambda a: a.join("block", "plate", contact_resistance=1e-4), r"the contact has no area.*Give area"),
    (lambda a: a.join("bar1", "room", contact_resistance=-1e-4), r"contact_resistance.*negative"),
    (lambda a: a.join("bar1", "room", convection=0.0), r"convection.*positive number"),
    (lambda a: a.lump("bar2", 3.0), r"the name 'bar2' is used twice"),
    (lambda a: a.lump("", 3.0), r"'' is no name"),
    (lambda a: a.lump("x", 0.0), r"lump 'x' capacity.*positive number"),
    (lambda a: a.ambient("lab", 25.0), r"ambient 'lab' temperature.*looks like Celsius"),
    (lambda a: a.stack([Contact(1e-4), Layer("l", 0.1, STUFF)], area=AREA), r"begins or ends with a contact"),
    (lambda a: a.stack([Contact(1e-4), Layer("l", 0.1, STUFF), Layer("m", 0.1, STUFF)], area=AREA), r"begins or ends"),
    (lambda a: a.stack([Layer("l", 0.1, STUFF), Contact(1e-4)], area=AREA), r"begins or ends with a contact"),
    (lambda a: a.stack([], area=AREA), r"has no layer"),
    (lambda a: a.stack(["copper"], area=AREA), r"stack part 1: 'copper'.*a Layer or a Contact"),
    (lambda a: Material("m", 0.0, 1.0, 1.0), r"material 'm' conductivity.*positive number"),
    (lambda a: a.system(), r"no heat path to an ambient from lump"),
])
def test_bad_assemblies_are_refused(call, message: str) -> None:
    with pytest.raises(rt.InputError, match=message):
        call(assembled())


def test_material_table_is_complete_and_plausible() -> None:
    """Volumetric heat of solids lies between 1 and 4.3 MJ/(m³ K); conductivities stand in their known order."""
    table = rt.thermal.materials()
    volumetric = table["density"] * table["specific_heat"] / 1e6
    assert ((volumetric > 1.0) & (volumetric < 4.3)).all()
    assert (table["source"].str.len() > 0).all()
    k = table["conductivity"]
    ladder = ["copper", "aluminium", "aluminium 6061", "brass", "carbon steel", "stainless 304", "invar",
              "fused silica", "POM", "PMMA"]
    assert (np.diff([k[name] for name in ladder]) < 0).all()
    for name, limits in table["conductivity_range"].dropna().items():
        assert limits[0] <= k[name] <= limits[1], name


@pytest.mark.parametrize("page", ["system", "modules"])
def test_the_code_of_the_documentation_runs(page: str, capsys: pytest.CaptureFixture[str]) -> None:
    text = (Path(__file__).parents[2] / "docs" / "explanations" / f"{page}.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)
    assert blocks
    for block in blocks:
        exec(compile(block, f"{page}.md", "exec"), {})
    assert capsys.readouterr().out
