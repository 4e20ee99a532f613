"""Design an experiment on two heaters, simulate it, and hold the estimate against what the design check expected.

    python examples/excitation/two_heaters.py
"""

from __future__ import annotations

import control
import numpy as np
from numpy.typing import NDArray

import robthermal as rt

BOARD = rt.systems.tclab()
SAMPLE_TIME = 2.0  # s
PERIOD = 1800  # samples: one hour
WATTS = [BOARD.inputs[name].gain for name in ("Q1", "Q2")]  # W per percent
NOISE = 0.05  # K


def excitation(phases: str) -> rt.signals.Excitation:
    """Both heaters at once, in one record, never below zero; standard deviation 10 percent."""
    return rt.signals.multisines(PERIOD, inputs=2, arrangement="independent", sample_time=SAMPLE_TIME, band=(0.0, 0.05),
                                 rms=10.0, offset="nonnegative", phases=phases, seed=1)


def nominal() -> control.StateSpace:
    """Linearized at rest, heaters only."""
    return rt.thermal.linearize(BOARD)[:, [0, 1]]


def expected(heat: rt.signals.Excitation) -> rt.signals.DesignCheck:
    """What the experiment will tell, before it is made."""
    return rt.signals.design_check(heat, sample_time=SAMPLE_TIME, model=nominal(), noise=NOISE, gain=WATTS)


def measured(heat: rt.signals.Excitation, seed: int = 2) -> rt.identify.FrequencyResponse:
    """The experiment, simulated with the nominal linear model from rest, and its frequency response by the LPM."""
    u = heat.experiments[0]
    time = np.arange(len(u)) * SAMPLE_TIME
    y = control.forced_response(nominal().sample(SAMPLE_TIME), time, u.T).outputs.T
    y = y + NOISE * np.random.default_rng(seed).normal(size=y.shape)
    return rt.identify.lpm(rt.Record(sample_time=SAMPLE_TIME, inputs=u, outputs=y, input_names=["Q1", "Q2"],
                                     output_names=["T1", "T2"]))


def errors(check: rt.signals.DesignCheck, G: rt.identify.FrequencyResponse) -> NDArray[np.float64]:
    """|error of G| over its expected standard deviation, at the excited lines."""
    lines = np.rint(check.frequencies * check.duration).astype(int) - 1
    return np.abs(G.response[..., lines] - check.response) / np.sqrt(check.variance)


def main() -> None:
    """Print everything."""
    print("Mean heat for the same power spectrum [W]")
    for phases in ("random", "low_crest"):
        heat = excitation(phases)
        check = expected(heat)
        print(f"  {phases:<10} heaters {check.mean_heat.round(3)}, largest {check.heat_range[:, 1].round(3)}; "
              f"crest factors {heat.crest_factors.max(axis=(0, 1)).round(2)}; "
              f"the board warms by {check.mean_rise.round(1)} K")
    print(f"\n{heat}\n\n{check}\n")
    ratio = errors(check, measured(heat))
    good = check.frequencies >= check.resolved_from
    print(f"rms of |error| / expected deviation: {np.sqrt(np.mean(ratio[..., good] ** 2)):.2f} where resolved, "
          f"{np.sqrt(np.mean(ratio[..., ~good] ** 2)):.2f} below")


if __name__ == "__main__":
    main()
