"""Every effect of the catalog against balances written by hand and integrated by scipy, and its sensitivities."""

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import robthermal as rt
from robthermal.thermal import _simulate

H, N, T0 = 4.0, 22, 296.0


def bench() -> rt.System:
    """Plate (heater) - cold | module | hot - room, everything linked to the room, all sensors."""
    return rt.System(
        ambients={"room": {"temperature": T0, "coolant": ("plate", "hot")}},
        lumps={name: {"capacity": c, "initial": T0 + d} for name, c, d in (
            ("plate", 20.0, 0.5), ("cold", 6.0, -1.0), ("hot", 9.0, 2.0))},
        links=[{"between": ("plate", "cold"), "conductance": 1.5}, {"between": ("hot", "room"), "conductance": 0.9},
               {"between": ("plate", "room"), "conductance": 0.06}],
        inputs={"q": {"lump": "plate", "gain": 0.7}, "v": {"lump": "plate", "gain": 0.0}},
        modules={"m": {"hot": "hot", "cold": "cold", "seebeck": {"value": 0.05, "slope": 1e-4},
                       "resistance": {"value": 2.0, "slope": 0.01}, "conductance": {"value": 0.3, "slope": 5e-4},
                       "reference_temperature": 300.0}},
        sensors={f"T_{name}": {"lump": name} for name in ("plate", "cold", "hot")})


def record(start=0.0) -> rt.Record:
    rng = np.random.default_rng(5)
    u = np.column_stack([rng.uniform(0, 3, N), rng.uniform(-1.0, 1.5, N), T0 + np.cumsum(rng.normal(0, 0.3, N)),
                         rng.uniform(0, 6, N)])
    return rt.Record(sample_time=H, inputs=u, outputs=np.zeros((N, 0)), input_names=["q", "m", "room", "v"],
                     output_names=[], start_time=start)


# effect, where, values, and the same numbers for the balance below
CASES = [
    ("seebeck_slope", ["m"], {"slope": 3e-4}), ("resistance_slope", ["m"], {"slope": 0.03}),
    ("conductance_slope", ["m"], {"slope": 2e-3}),
    ("thomson", ["m"], {"coefficient": 8e-3}), ("joule_split", ["m"], {"split": 0.3}),
    ("hysteresis", ["m"], {"heat": 0.5, "time_constant": 15.0}),
    ("natural_convection", ["plate", "room"], {"gain": 0.05, "exponent": 0.3}),
    ("radiation", ["plate", "room"], {"coefficient": 3e-9}), ("missing_link", ["plate", "hot"], {"conductance": 0.2}),
    ("missing_ambient_link", ["cold", "room"], {"conductance": 0.3}), ("heat_source", ["cold"], {"heat": 0.8}),
    ("sensor_self_heating", ["T_cold"], {"heat": 0.4}), ("lead_heating", ["plate", "m"], {"resistance": 0.6}),
    ("hidden_mass", ["plate"], {"capacity": 8.0, "time_constant": 25.0}),
    ("coolant_warming", ["room"], {"warming": 5.0}),
    ("path_mass", ["hot-room"], {"capacity": 12.0, "ratio": 0.4}),
    ("input_gain", ["q"], {"gain": 0.3}), ("input_gain", ["m"], {"gain": -0.2}),
    ("input_offset", ["q"], {"offset": 0.5}), ("input_offset", ["m"], {"offset": 0.2}),
    ("input_saturation", ["q"], {"cubic": 0.03}), ("input_saturation", ["m"], {"cubic": 0.1}),
    ("input_saturation", ["m"], {"clip": 0.8}),
    ("input_saturation", ["q"], {"gain_slope": -0.12}), ("input_gain_slope", ["q"], {"slope": 0.3}),
    ("input_delay", ["q"], {"delay": 5.3}), ("input_delay", ["m"], {"delay": 1.7}),
    ("input_lag", ["q"], {"time_constant": 6.0}), ("input_lag", ["m"], {"time_constant": 5.0}),
    ("heater_power_slope", ["q"], {"slope": 0.02}), ("input_feedthrough", ["q", "hot"], {"share": 0.4}),
    ("ambient_gradient", ["plate"], {"difference": 2.5}),
    ("periodic_load", ["cold"], {"heat": 0.9, "period": 37.0, "phase": 0.7}),
    ("conductance_step", ["plate-cold"], {"relative": -0.4, "time": 130.0}),
    ("driven_conductance", ["plate-cold", "m"], {"relative": 0.4}), ("driven_heat", ["v", "cold"], {"gain": 0.2}),
    ("condensation", ["cold"], {"conductance": 0.5, "dew_point": 296.2}),
    ("conductance_exponent", ["plate-cold"], {"exponent": -1.4}),
]
IDS = [f"{effect} {where[0]}" for effect, where, _ in CASES]


def shaped(effect: str, p: dict, u: float) -> float:
    """What an effect on an input makes of its commanded value."""
    if effect == "input_gain":
        return (1 + p["gain"]) * u
    if effect == "input_offset":
        return u + p["offset"]
    if effect == "input_gain_slope" or "gain_slope" in p:
        return u * (1 + p.get("slope", p.get("gain_slope")) * abs(u))
    if effect == "input_saturation":
        return np.clip(u, -p["clip"], p["clip"]) if "clip" in p else u - p["cubic"] * u**3
    return u


def heat_added(effect: str, p: dict, y: Sequence[float], acting: Sequence[float]) -> tuple[dict[str, float], float]:
    """Heat [W] that an effect adds to lumps, and the derivative of its own state."""
    (plate, cold, hot, extra), (current, ambient, time) = y, acting
    match effect:
        case "hysteresis":
            return {"cold": p["heat"] * extra}, (np.sign(current) - extra) / p["time_constant"]
        case "hidden_mass":
            flow = p["capacity"] / p["time_constant"] * (extra - plate)
            return {"plate": flow}, -flow / p["capacity"]
        case "coolant_warming":  # 0.06 W/K at the plate warm it by 0.3 of their difference; 0.9 W/K take it up
            return {"hot": 0.9 * 0.06 * p["warming"] * (plate - ambient)}, 0.0
        case "path_mass":  # 0.9 W/K, of whose resistance 0.4/1.4 lie before the mass
            before, after = 0.9 * 1.4 / 0.4 * (extra - hot), 0.9 * 1.4 * (ambient - extra)
            return {"hot": before - 0.9 * (ambient - hot)}, (after - before) / p["capacity"]
        case "natural_convection":
            return {"plate": p["gain"] * abs(ambient - plate) ** p["exponent"] * (ambient - plate)}, 0.0
        case "radiation":
            return {"plate": p["coefficient"] * (ambient**4 - plate**4)}, 0.0
        case "missing_link":
            return {"plate": p["conductance"] * (hot - plate), "hot": p["conductance"] * (plate - hot)}, 0.0
        case "missing_ambient_link":
            return {"cold": p["conductance"] * (ambient - cold)}, 0.0
        case "heat_source" | "sensor_self_heating":
            return {"cold": p["heat"]}, 0.0
        case "lead_heating":
            return {"plate": p["resistance"] * current**2}, 0.0
        case "periodic_load":
            return {"cold": p["heat"] * np.sin(2 * np.pi * time / p["period"] + p["phase"])}, 0.0
        case "condensation":
            return {"cold": p["conductance"] * max(0.0, p["dew_point"] - cold)}, 0.0
        case _:
            return {}, 0.0


def truth(effect: str, where: list, p: dict, run: rt.Record) -> np.ndarray:
    """Temperatures (n, 3), straight from the table of effects: nothing of the package but the record's numbers."""
    q, m, room, v = (run[name] for name in ("q", "m", "room", "v"))
    is_ = lambda name, part=None: effect == name and (part is None or where[0] == part)  # noqa: E731

    def held(name, column, t):
        if is_("input_delay", name):
            t = t - p["delay"]
        u = column[max(int(np.floor(t / H + 1e-12)), 0)]
        return shaped(effect, p, u) if where[0] == name else u

    def balance(t, y, mid):  # `mid`: a time inside the present piece, for what is held
        plate, cold, hot, extra, lagged = y
        wall, ambient = mid + run.start_time, room[int(mid // H)]
        power, current = held("q", q, mid), held("m", m, mid)
        d_lag = 0.0
        if effect == "input_lag":
            u = power if where[0] == "q" else current
            d_lag = (u - lagged) / p["time_constant"]
            power, current = (lagged, current) if where[0] == "q" else (power, lagged)
        warm = ambient + (p["difference"] if is_("ambient_gradient") else 0.0)
        mean = 0.5 * (hot + cold) - 300.0
        slope = lambda name, value: p["slope"] if is_(name) else value  # noqa: E731
        S, R = 0.05 + slope("seebeck_slope", 1e-4) * mean, 2.0 + slope("resistance_slope", 0.01) * mean
        K = 0.3 + slope("conductance_slope", 5e-4) * mean
        heat = 0.7 * power * (1 + (p["slope"] * (plate - T0) if is_("heater_power_slope") else 0.0))
        through = p["share"] * heat if is_("input_feedthrough") else 0.0
        g = 1.5 * (1 + p["relative"] * (wall >= p["time"]) if is_("conductance_step") else 1.0)
        g *= 1 + p["relative"] * abs(current) if is_("driven_conductance") else 1.0
        g *= (0.5 * (plate + cold) / T0) ** p["exponent"] if is_("conductance_exponent") else 1.0
        taken = 0.5 * p["coefficient"] * current * (hot - cold) if is_("thomson") else 0.0
        moved = p["split"] * R * current**2 if is_("joule_split") else 0.0
        into = {"plate": g * (cold - plate) + 0.06 * (warm - plate) + heat - through,
                "cold": g * (plate - cold) - S * cold * current + 0.5 * R * current**2 + K * (hot - cold) - taken
                + moved,
                "hot": 0.9 * (ambient - hot) + S * hot * current + 0.5 * R * current**2 - K * (hot - cold) - taken
                - moved + through}
        into["cold"] += p["gain"] * held("v", v, mid) if is_("driven_heat") else 0.0
        heats, d_extra = heat_added(effect, p, y[:4], (current, ambient, t + run.start_time))
        into = {lump: flow + heats.get(lump, 0.0) for lump, flow in into.items()}
        return [into["plate"] / 20, into["cold"] / 6, into["hot"] / 9, d_extra, d_lag]

    start_lag = {"q": q, "m": m}[where[0]][0] if effect == "input_lag" else 0.0
    extra = {"hysteresis": 0.0, "path_mass": T0 + 2.0 / 1.4}.get(effect, T0 + 0.5)
    y = np.array([T0 + 0.5, T0 - 1.0, T0 + 2.0, extra, start_lag])
    out = [y[:3]]
    for k in range(N - 1):
        inside = {p["delay"] % H} if effect == "input_delay" else set()
        if effect == "conductance_step":
            inside |= {x for x in [p["time"] - run.start_time - k * H] if 0 < x < H}
        cuts = k * H + np.array([0.0, *sorted(inside), H])
        for a, b in zip(cuts[:-1], cuts[1:], strict=True):
            y = solve_ivp(balance, (a, b), y, method="DOP853", rtol=1e-10, atol=1e-10, args=(0.5 * (a + b),)).y[:, -1]
        out.append(y[:3])
    return np.array(out)


@pytest.mark.parametrize(("effect", "where", "values"), CASES, ids=IDS)
def test_simulation_is_the_balance_written_by_hand(effect, where, values):
    run = record(start=60.0)
    added = rt.thermal.add_effect(without_slope(effect), effect, where, values)
    found = rt.thermal.trajectory(added.system, run, tolerance=1e-6)
    assert np.abs(found.lumps[:, :3] - truth(effect, where, values, run)).max() < 2e-5
    plain = rt.thermal.trajectory(without_slope(effect), run).lumps
    assert np.abs(found.lumps[:, :3] - plain).max() > 0.03  # the effect is there
    turnover = np.abs(found.ambient_heat).max() + np.abs(found.electrical_energy).max()
    assert np.abs(found.energy_residual).max() < 1e-11 * turnover


def without_slope(effect: str) -> rt.System:
    names = {"seebeck_slope": "seebeck", "resistance_slope": "resistance", "conductance_slope": "conductance"}
    return bench().with_parameters({f"modules.m.{names[effect]}.slope": 0.0}) if effect in names else bench()


@pytest.mark.parametrize(("effect", "where", "values"), CASES, ids=IDS)
def test_file_round_trip_is_exact(effect, where, values):
    system = rt.thermal.add_effect(without_slope(effect), effect, where, values).system
    for unit in ("K", "degC"):
        one = system.model_copy(update={"temperature_unit": unit})
        assert rt.thermal.parse_system(rt.thermal.format_system(one)) == one


FINE = 1e-6  # finer, and the steps at the kinks of natural convection and condensation take seconds


def readings(system, run):
    return rt.thermal.trajectory(system, run, tolerance=FINE).readings


@pytest.mark.parametrize(("effect", "where", "values"), CASES, ids=IDS)
def test_sensitivities_are_the_derivatives(effect, where, values):
    run = record(start=60.0)
    added = rt.thermal.add_effect(without_slope(effect), effect, where, values)
    names = list(added.parameters.values())
    assert len(names) == len(values)
    exact = rt.thermal.trajectory(added.system, run, sensitivities=names, tolerance=FINE).sensitivity
    for column, name in enumerate(names):
        value = added.system.parameter(name)
        step = 1e-4 * abs(value) if "dew" not in name else 1e-3

        def moved(k, name=name, value=value, step=step):
            return readings(added.system.with_parameters({name: value + k * step}), run)

        difference = (moved(-2) - 8 * moved(-1) + 8 * moved(1) - moved(2)) / (12 * step)
        size = np.abs(difference).max()
        assert size > 0, name
        tolerance = 1e-3 if effect == "condensation" else 2e-4  # its slope jumps at the dew point
        assert np.abs(difference - exact[..., column]).max() < tolerance * size, name


@pytest.mark.parametrize(("effect", "where", "values"), CASES, ids=IDS)
def test_sensitivities_at_zero_are_one_sided_derivatives(effect, where, values):
    run, kind = record(start=60.0), rt.thermal.effects()[effect]
    size = next(name for name in values if name in kind.sizes)
    if size == "clip" or effect.endswith("_mass"):
        pytest.skip("has no zero")
    shape = {name: value for name, value in values.items() if name not in kind.sizes}
    added = rt.thermal.add_effect(without_slope(effect), effect, where, {**shape, size: 0.0})
    name = added.parameters[size]
    exact = rt.thermal.trajectory(added.system, run, sensitivities=[name], tolerance=FINE).sensitivity[..., 0]
    step = (2e-2 if effect == "input_lag" else 1e-3) * abs(values[size])  # a lag far below a sample is stiff
    at = [readings(added.system.with_parameters({name: added.system.parameter(name) + k * step}), run)
          for k in range(4)]
    difference = (-11 * at[0] + 18 * at[1] - 9 * at[2] + 2 * at[3]) / (6 * step)
    tolerance = 2e-3 if effect in ("input_lag", "condensation") else 2e-4
    assert np.abs(difference - exact).max() < tolerance * np.abs(exact).max()
    assert added.system.effects == ()


def everything() -> rt.System:
    """All effects without memory at once: they must not disturb each other's derivatives."""
    system = bench()
    for effect, where, values in CASES:
        if effect in ("hysteresis", "hidden_mass", "path_mass", "input_delay", "input_lag", "periodic_load",
                      "conductance_step"):
            continue
        if values.keys() & {"clip", "gain_slope"} or effect.endswith("_slope") and where == ["m"]:
            continue
        system = rt.thermal.add_effect(system, effect, where, values).system
    return system


def test_equations_and_their_jacobians_agree_with_all_effects_at_once():
    eq = rt.thermal.Equations(everything())
    x, u = np.array([297.0, 295.0, 301.0]), np.array([1.3, 4.0, 0.6, 295.0])  # q, v, m, room
    for jacobian, f, z in ((eq.jacobian(x, u), lambda z: eq.heat(z, u), x),
                           (eq.input_jacobian(x, u), lambda z: eq.heat(x, z), u)):
        columns = [f(z.astype(complex) + 1e-40j * e).imag / 1e-40 for e in np.eye(z.size)]
        assert jacobian.toarray() == pytest.approx(np.array(columns).T, rel=1e-12, abs=1e-12)
    for name in eq.system.parameter_names:
        if name.endswith((".initial", ".disturbance", ".delay", ".time_constant", ".noise", ".capacity")):
            continue
        value, exact = eq.system.parameter(name), np.zeros(3)
        if not value and name.startswith("links."):
            continue  # cannot be negative
        step = 1e-3 * abs(value) if value and value < 200 else 1e-3
        for i, heat in eq.parameter_heat(name, x, u):
            exact[i] += heat

        def heat_at(k, name=name, value=value, step=step):
            return rt.thermal.Equations(eq.system.with_parameters({name: value + k * step})).heat(x, u)

        if name.startswith("ambients."):
            continue  # moves T_ref and, without a column, the surroundings: tested on trajectories
        difference = (-heat_at(2) + 8 * heat_at(1) - 8 * heat_at(-1) + heat_at(-2)) / (12 * step)
        assert exact == pytest.approx(difference, rel=1e-7, abs=1e-9 * np.abs(difference).max() + 1e-8), name


@pytest.mark.exhaustive
def test_all_effects_together_have_exact_sensitivities():
    system, run = everything(), record().select(inputs=["q", "m", "v"], outputs=[])
    names = ["ambients.room.temperature", "inputs.q.gain", "inputs.q.feedthrough.share", "lumps.plate.gradient",
             "links.plate-room.conductance", "modules.m.drive.cubic", "leads.m-plate.resistance"]
    exact = rt.thermal.trajectory(system, run, sensitivities=names, tolerance=FINE).sensitivity
    for column, name in enumerate(names):
        value = system.parameter(name)
        step = 1e-3 * value if value < 200 else 1e-2
        up, down = (readings(system.with_parameters({name: value + k * step}), run) for k in (1, -1))
        difference = (up - down) / (2 * step)
        assert np.abs(exact[..., column] - difference).max() < 1e-3 * np.abs(difference).max(), name


@pytest.mark.parametrize("effect", ["heat_source", "ambient_gradient", "heater_power_slope", "lead_heating",
                                    "condensation", "thomson", "input_feedthrough", "input_gain",
                                    "driven_conductance", "coolant_warming"])
def test_large_networks_simulate_the_same(effect, monkeypatch):
    where, values = next((where, values) for name, where, values in CASES if name == effect)
    system = rt.thermal.add_effect(bench(), effect, where, values).system
    dense = rt.thermal.trajectory(system, record())
    monkeypatch.setattr(_simulate, "_DENSE_STATES", 0)
    sparse = rt.thermal.trajectory(system, record())
    assert sparse.method == "implicit"
    assert np.abs(dense.lumps - sparse.lumps).max() < 0.01
    for name in ("ambient_heat", "heater_heat", "electrical_energy", "source_heat"):
        assert getattr(sparse, name) == pytest.approx(getattr(dense, name), abs=0.2), name


def test_large_networks_refuse_what_needs_memory(monkeypatch):
    monkeypatch.setattr(_simulate, "_DENSE_STATES", 0)
    system = rt.thermal.add_effect(bench(), "input_lag", ["m"], {"time_constant": 3.0}).system
    with pytest.raises(rt.InputError, match=r"modules\.m\.drive\.time_constant"):
        rt.thermal.trajectory(system, record())


def test_linearization_follows_a_lagged_input():
    system = rt.thermal.add_effect(bench(), "input_lag", ["q"], {"time_constant": 6.0}).system
    lagged, plain = rt.thermal.linearize(system), rt.thermal.linearize(bench())
    s = 0.11j
    assert lagged(s)[:, 0] == pytest.approx(plain(s)[:, 0] / (1 + 6.0 * s), rel=1e-9)
    assert lagged(s)[:, 1:] == pytest.approx(plain(s)[:, 1:], rel=1e-9)
    assert lagged.state_labels[-1] == "q_lag"


def test_steady_state_is_where_the_simulation_ends():
    system = everything()
    long = rt.Record(sample_time=200.0, inputs=np.tile([1.0, 0.5, T0, 3.0], (40, 1)), outputs=np.zeros((40, 0)),
                     input_names=["q", "m", "room", "v"], output_names=[])
    end = rt.thermal.trajectory(system, long).lumps[-1]
    found = rt.thermal.steady_state(system, {"q": 1.0, "m": 0.5, "v": 3.0}).equilibria[0].temperatures
    assert end == pytest.approx(list(found.values()), abs=1e-3)


def test_stepping_equals_simulating():
    system = everything()
    for effect, where, values in CASES:
        if effect in ("hysteresis", "input_lag", "periodic_load"):
            system = rt.thermal.add_effect(system, effect, where, values).system if effect != "input_lag" else system
    start = {"plate": 297.0, "cold": 296.0, "hot": 298.0}
    run = rt.thermal.trajectory(system, record(), initial=start)
    plant = rt.thermal.Stepper(system, H, initial=start)
    names = ("q", "m", "room", "v")
    columns = [record()[name] for name in names]
    steps = [plant.step(dict(zip(names, values, strict=True))) for values in zip(*columns, strict=True)]
    assert np.array(steps[:-1]) == pytest.approx(run.lumps[1:], abs=1e-3)
    delayed = rt.thermal.add_effect(bench(), "input_delay", ["q"], {"delay": 3.0}).system
    with pytest.raises(rt.InputError, match=r"inputs\.q\.drive\.delay when stepping"):
        rt.thermal.Stepper(delayed, H)


@pytest.mark.parametrize(("effect", "where", "values"), [
    ("thomson", ["m"], {"coefficient": 8e-3}), ("lead_heating", ["plate", "m"], {"resistance": 0.6}),
    ("input_offset", ["m"], {"offset": 0.2}), ("input_lag", ["q"], {"time_constant": 10.0})])
def test_calibration_finds_the_effect(effect, where, values):
    added = rt.thermal.add_effect(bench(), effect, where, values)
    clean = rt.thermal.simulate(added.system, record())
    rng = np.random.default_rng(2)
    data = clean.with_outputs(clean.outputs + 0.002 * rng.standard_normal(clean.outputs.shape))
    (size, name), = added.parameters.items()
    low, high = (0.0, 30.0) if effect == "input_lag" else (-1.0, 1.0)
    start = rt.thermal.add_effect(bench(), effect, where, {size: 3.0 if effect == "input_lag" else 0.0})
    fit = rt.calibrate(start.system, data, parameters={name: (low, high)}, initial="system", noise=0.002)
    assert fit.parameters[name] == pytest.approx(values[size], abs=5 * np.sqrt(fit.covariance[0, 0]))
    assert np.sqrt(fit.covariance[0, 0]) < 0.1 * abs(values[size])


@pytest.mark.parametrize(("arguments", "message"), [
    (("magic", ["m"], {}), "no effect 'magic'"), (("thomson", ["plate"], {}), "no module 'plate'"),
    (("thomson", ["m", "hot"], {}), "argument where"), (("thomson", ["m"], {"gain": 1.0}), "no parameter 'gain'"),
    (("condensation", ["cold"], {"conductance": -1.0}), "conductance = -1"),
    (("input_feedthrough", ["q", "plate"], {}), "own lump"), (("input_delay", ["q"], {"delay": -1.0}), "delay"),
    (("resistance_slope", ["m"], {}), "already")])
def test_bad_effects_are_refused(arguments, message):
    with pytest.raises(rt.InputError, match=message):
        rt.thermal.add_effect(bench(), *arguments)


@pytest.mark.parametrize(("table", "message"), [
    ("[[leads]]\nmodule = 'x'\nlump = 'a'\nresistance = 0.1", r"\[\[leads\]\] number 1 module"),
    ("[[leads]]\nmodul = 'x'\nlump = 'a'\nresistance = 0.1", "Did you mean 'module'"),
    ("[[flows]]\nupstream = 'x'\ndownstream = 'a'\nambient = 'room'", r"\[\[flows\]\] number 1 upstream"),
    ("[[flows]]\nupstream = 'a'\ndownstream = 'a'\nambient = 'room'", "from one lump to another"),
    ("[inputs.q]\nlump = 'a'\ndrive = { gian = 0.1 }", "Did you mean 'gain'"),
    ("[inputs.q]\nlump = 'a'\nfeedthrough = { lump = 'b', share = 0.1 }", "feedthrough"),
    ("[inputs.q]\nlump = 'a'\nfeedthrough = { lump = 'b', share = 2.0 }", "at most 1"),
    ("[[links]]\nbetween = ['a', 'room']\nname = 'l'\nconductance = 1.0\nfollow = { column = 'b', relative = 0.1 }",
     r"\[\[links\]\] number 2 follow.column: 'b' does not exist"),
    ("[inputs.F]\nlump = 'a'\ngain = 0.0\n[[links]]\nbetween = ['a', 'room']\nname = 'l'\nconductance = 1.0\n"
     "follow = { column = 'F', relative = -0.1 }", "at least 0"),
    ("[lumps.b]\ncapacity = 1.0\ncondensation = { dew_point = 10.0 }", "150 K")])
def test_bad_keys_are_refused(table, message):
    text = ("[system]\ntemperature_unit = 'K'\n[ambients.room]\ntemperature = 300.0\n[lumps.a]\ncapacity = 1.0\n"
            "[[links]]\nbetween = ['a', 'room']\nconductance = 1.0\n" + table)
    with pytest.raises(rt.InputError, match=message):
        rt.thermal.parse_system(text)
