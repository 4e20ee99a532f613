"""Commands frf and excitation: from a designed signal to an estimate that covers the truth."""

import json

import numpy as np
import pytest
from commands import command

import robthermal as rt


@pytest.fixture(scope="module")
def bar(tmp_path_factory):
    """A heated bar, and a folder with its system file and a record simulated with noise."""
    folder = tmp_path_factory.mktemp("bar")
    system = rt.System(name="bar", ambients={"room": {"temperature": 298.15}}, lumps={"bar": {"capacity": 40.0}},
                       links=[{"between": ("bar", "room"), "conductance": 2.0}], sensors={"T": {"lump": "bar"}},
                       inputs={"q": {"lump": "bar"}})
    rt.thermal.write_system(system, folder / "bar.toml")
    done = command("excitation", "q", "--period", 1000, "--sample-time", 1, "--band", 0.001, 0.2, "--amplitude", 5,
                   "--nonnegative", "--periods", 2, "--system", "bar.toml", "--out", "u.csv", "--json", folder=folder)
    assert done.status == 0, done.err
    drive = rt.read_record(folder / "u.csv", inputs=["q"], outputs=[])
    assert drive["q"].min() >= -1e-9
    clean = rt.thermal.simulate(system, drive)
    noisy = clean.outputs + np.random.default_rng(0).normal(0, 0.01, clean.outputs.shape)
    rt.Record(sample_time=1.0, inputs=drive.inputs, outputs=noisy, input_names=["q"], output_names=["T"]).save(
        folder / "run.csv")
    return system, folder


def test_excitation_says_what_stays_unresolved(bar):
    _, folder = bar
    shown = command("excitation", "q", "--period", 1000, "--sample-time", 1, "--band", 0.001, 0.2, "--amplitude", 5,
                    "--system", "bar.toml", folder=folder)
    assert shown.status == 0 and "time constant" in shown.out and (folder / "excitation.csv").is_file()


def test_frf_covers_the_truth(bar):
    system, folder = bar
    done = command("frf", "run.csv", "--system", "bar.toml", "--method", "lrmp", "--out", "G.json",
                   "--plot", "G.svg", "--band", 0.002, 0.2, "--json", folder=folder)
    assert done.status == 0, done.err
    summary = json.loads(done.out)
    assert summary["inputs"] == ["q"] and summary["outputs"] == ["T"] and (folder / "G.svg").is_file()
    G = rt.identify.FrequencyResponse.load(folder / "G.json")
    z = np.exp(2j * np.pi * G.frequencies)
    p = np.exp(-2.0 / 40.0)
    truth = 0.5 * (1 - p) / (z - p)
    inside = np.abs(G.response[0, 0] - truth) <= G.confidence_radius(0.95)[0, 0]
    assert 0.9 <= inside.mean() <= 0.99


@pytest.mark.parametrize(("arguments", "words"), [
    (["run.csv"], "--system"), (["run.csv", "--system", "bar.toml", "--method", "magic"], "--method"),
    (["run.csv", "--input", "q", "--output", "nothing"], "nothing"),
    (["run.csv", "--system", "bar.toml", "--half-width", "-1"], "half_width")])
def test_bad_requests_are_one_message_and_status_two(bar, arguments, words):
    _, folder = bar
    done = command("frf", *arguments, folder=folder)
    assert done.status == 2 and words in done.err and "Traceback" not in done.err
    assert not (folder / "frf.json").exists()


def test_inputs_that_never_change_are_left_out_and_stay_in_the_operating_point(bar):
    """Two inputs, two outputs, a column of another name, a room that never changes: every ordinary record."""
    _, folder = bar
    system = rt.System(
        name="two", ambients={"room": {"temperature": 295.0}},
        lumps={"a": {"capacity": 40.0}, "b": {"capacity": 60.0}},
        links=[{"between": ("a", "room"), "conductance": 2.0}, {"between": ("b", "room"), "conductance": 1.0}],
        sensors={"Ta": {"lump": "a"}, "Tb": {"lump": "b"}}, inputs={"qa": {"lump": "a"}, "qb": {"lump": "b"}})
    rt.thermal.write_system(system, folder / "two.toml")
    rng = np.random.default_rng(0)
    q, rows = 5.0 + rng.normal(size=600), ["time [s];heater 1 [W];qb [W];room [K];NTC 1 [K];Tb [K]"]
    T = 295.0 + np.convolve(q, 0.5 * (1 - np.exp(-0.05)) * np.exp(-0.05 * np.arange(600)))[:600]
    T += 0.01 * rng.normal(size=600)
    rows += [f"{k};{q[k]:.6f};1.5;294.0;{T[k]:.6f};{296.5 + 0.01 * rng.normal():.6f}" for k in range(600)]
    (folder / "two.csv").write_text("\n".join(rows), encoding="utf-8")
    for out in ("G.json", "G.npz", "G.mat"):
        done = command("frf", "two.csv", "--system", "two.toml", "--column", "qa=heater 1", "--column", "Ta=NTC 1",
                       "--input", "qa", "--input", "qb", "--output", "Ta", "--output", "Tb", "--out", out, "--json",
                       folder=folder)
        assert done.status == 0, done.err
        G = rt.identify.read_response(folder / out)
        assert (G.input_names, G.output_names) == (("qa",), ("Ta", "Tb")) and G.has_covariance
        assert G.operating_point == {"qa": pytest.approx(q.mean(), abs=1e-6), "qb": 1.5, "room": 294.0}
        assert [one.code for one in G.remarks] == ["constant_input"]
        assert "qb" in json.loads(done.out)["notes"][-1] and "qb" in G.notes[-1]
        np.testing.assert_allclose(G.covariance[0, 0], rt.identify.read_response(folder / "G.json").covariance[0, 0])


def test_no_input_that_changes_is_refused_with_its_name(bar):
    system, folder = bar
    rest = rt.Record(sample_time=1.0, inputs=np.full(300, 2.0), outputs=np.full(300, 299.0), input_names=["q"],
                     output_names=["T"])
    rest.save(folder / "rest.csv")
    done = command("frf", "rest.csv", "--system", "bar.toml", folder=folder)
    assert done.status == 2 and "no input changes: q" in done.err


def test_a_noisy_room_takes_a_second_sensor_or_its_noise(bar):
    """The response to the room, not drawn towards zero by the noise of the sensor that measures it."""
    _, folder = bar
    rng = np.random.default_rng(4)
    q, room, T = rng.normal(size=1500), rng.normal(size=1500), np.zeros(1500)
    for k in range(1499):
        T[k + 1] = 0.5 * T[k] + 0.3 * q[k] + 0.5 * room[k]
    one, two = (room + 0.5 * rng.normal(size=1500) for _ in range(2))
    rt.Record(sample_time=1.0, inputs=np.column_stack([q, one, two]), outputs=T + 0.01 * rng.normal(size=1500),
              input_names=["q", "room", "room 2"], output_names=["T"]).save(folder / "noisy.csv")
    found = {}
    for key, more in (("exact", ()), ("instrument", ("--instrument", "room=room 2")),
                      ("noise", ("--input-noise", "room=0.5"))):
        done = command("frf", "noisy.csv", "--input", "q", "--input", "room", "--output", "T", "--half-width", 20,
                       *more, "--out", f"{key}.json", "--json", folder=folder)
        assert done.status == 0, done.err
        G = rt.identify.FrequencyResponse.load(folder / f"{key}.json")
        truth = 0.5 / (np.exp(2j * np.pi * G.frequencies) - 0.5)
        found[key] = abs(np.mean((G.response[0, 1] / truth)[30:300]))
    assert found["exact"] < 0.87 and abs(found["instrument"] - 1) < 0.05 and abs(found["noise"] - 1) < 0.05
    both = command("frf", "noisy.csv", "--input", "room", "--output", "T", "--instrument", "room=room 2",
                   "--input-noise", "room=0.5", folder=folder)
    bad = command("frf", "noisy.csv", "--input", "room", "--output", "T", "--instrument", "room", folder=folder)
    assert both.status == bad.status == 2 and "given together" in both.err and "INPUT=COLUMN" in bad.err


def test_uncertain_poles_widen_the_bands(bar):
    """The pole of the bar is off by 20 %, and known to be."""
    system, folder = bar
    found = {}
    for key, more in (("sure", ()), ("unsure", ("--pole-deviation", 0.2))):
        done = command("frf", "run.csv", "--system", "bar.toml", "--method", "lrmp", "--pole", -0.06, *more,
                       "--out", f"{key}.json", "--json", folder=folder)
        assert done.status == 0, done.err
        found[key] = rt.identify.FrequencyResponse.load(folder / f"{key}.json")
    radii = {key: G.confidence_radius(0.95)[0, 0] for key, G in found.items()}
    assert (radii["unsure"] >= radii["sure"]).all() and (radii["unsure"] > 1.5 * radii["sure"]).any()
    assert "poles within 20 %" in found["unsure"].method
    refused = command("frf", "run.csv", "--system", "bar.toml", "--pole-deviation", 0.2, folder=folder)
    assert refused.status == 2 and "lrmp" in refused.err


def test_functions_instead_of_poles(bar):
    """The bar has one pole: as a fractional pole of order one it is the same response as with the pole."""
    system, folder = bar
    found = {}
    for key, more in (("pole", ("--pole", -0.06)), ("function", ("--basis", "fractional:0.06:1"))):
        done = command("frf", "run.csv", "--system", "bar.toml", "--method", "lrmp", *more, "--out", f"{key}.json",
                       folder=folder)
        assert done.status == 0, done.err
        found[key] = rt.identify.FrequencyResponse.load(folder / f"{key}.json")
    away = np.abs(found["function"].response - found["pole"].response)
    known = np.isfinite(away) & np.isfinite(found["pole"].confidence_radius())
    assert known.mean() > 0.4 and (away < 2.0 * found["pole"].confidence_radius())[known].mean() > 0.95
    assert found["function"].method.startswith("lrmp, fractional:0.06:1")
    for more, said in ((("--basis", "sqrt"), "diffusion:held:TAU"), (("--basis", "diffusion", "--pole", -1), "poles")):
        refused = command("frf", "run.csv", "--system", "bar.toml", "--method", "lrmp", *more, folder=folder)
        assert refused.status == 2 and said in refused.err
