"""Write the demo scanner as files: SPEC.toml for `robthermal couple`, and one FRF per stage and position.

The machine is `robthermal.systems.scanner`; its responses are SIMULATED. Give a folder as argument (default: this one).
"""

import sys
from pathlib import Path

import control
import numpy as np

import robthermal as rt

DESIGN = """
[design]                  # the keyword arguments of robthermal.coupling.synthesize
window = 0.01             # s, exposure
msd_limit = 1.2           # moving standard deviation, coupled / uncoupled
margin = 0.1              # the robust number stays below 1 - margin
stable_controller = true
"""


def table(system: control.StateSpace) -> str:
    """State space as an inline TOML table, every digit kept."""
    parts = ((name, np.asarray(getattr(system, name), float).tolist()) for name in "ABCD")
    return "{ " + ", ".join(f"{name} = {values}" for name, values in parts) + " }"


def spec(machine: rt.systems.Scanner) -> str:
    """The text of SPEC.toml."""
    lines = ["[coupling]", f'name = "{"-".join(machine.names)}"', f"sample_time = {machine.sample_time}  # s"]
    systems = zip(machine.names, (machine.P1, machine.P2), (machine.C1, machine.C2), machine.disturbances, strict=True)
    for number, (name, plant, controller, disturbance) in enumerate(systems, start=1):
        lines += ["", f"[subsystems.{number}]", f'name = "{name}"', f"plant = {table(plant)}  # N -> m",
                  f"controller = {table(controller)}  # m -> N",
                  f"disturbance = {table(disturbance)}  # white noise, variance 1 per sample -> m"]
    lines += ["", "[uncertainty]  # the k-th files of both lists are one machine position"]
    lines += [f"frf_{number} = {file_names(machine, number)}".replace("'", '"') for number in (1, 2)]
    return "\n".join(lines) + "\n" + DESIGN


def file_names(machine: rt.systems.Scanner, number: int) -> list[str]:
    """Names of the FRF files of one stage."""
    return [f"{machine.names[number - 1]}_{k}.csv" for k in range(1, len(machine.frf) + 1)]


def main(folder: Path) -> None:
    """Write everything."""
    folder.mkdir(parents=True, exist_ok=True)
    machine = rt.systems.scanner()
    (folder / "SPEC.toml").write_text(spec(machine), encoding="utf-8")
    for number in (1, 2):
        for name, frf in zip(file_names(machine, number), machine.frf, strict=True):
            response = frf.frdata[number - 1, number - 1]
            np.savetxt(folder / name, np.column_stack([frf.omega / (2 * np.pi), response.real, response.imag]),
                       fmt=("%.6g", "%.9e", "%.9e"), delimiter=",", header="frequency,real,imag", comments="")
    print(folder / "SPEC.toml", "and", 2 * len(machine.frf), "frequency responses")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
