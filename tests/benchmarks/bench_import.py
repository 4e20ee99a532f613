"""Reading a logger's text file, beside pandas in the same run: processor time at 10⁶ rows, memory at 10⁷.

python tests/benchmarks/bench_import.py [ROWS ...]; every reader runs in a process of its own, whose memory is its own.
The file: ";" between six columns, decimal comma, ISO stamps, °C and mA and mW in headers, as a German logger writes it.
pandas is told all that (sep, decimal, parse_dates); robthermal finds it, checks every row, converts units, looks for
gaps, jitter, fault codes and glitches, and hashes the file.
"""

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from _timing import header

COLUMNS = {"T1": "NTC 1", "T2": "NTC 2", "m1": "I_TEC", "heater": "Heizer", "room": "Raum"}


def write(path, n):
    """A day and more of a stage with a module and a heater, once a second."""
    rng = np.random.default_rng(0)
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write("Zeitstempel;NTC 1 [°C];NTC 2 [°C];I_TEC [mA];Heizer [mW];Raum (°C)\r\n")
        for first in range(0, n, 500_000):
            k = np.arange(first, min(first + 500_000, n))
            stamps = np.datetime_as_string(np.datetime64("2024-01-01T00:00:00") + k.astype("timedelta64[s]"))
            rows = zip(stamps.tolist(), 20 + 3 * np.sin(k / 500) + rng.normal(0, 0.01, len(k)),
                       25 + 2 * np.cos(k / 900) + rng.normal(0, 0.01, len(k)), 500.0 + 100.0 * (k // 600 % 2),
                       250 * (k // 900 % 3), 23 + rng.normal(0, 0.05, len(k)), strict=True)
            text = "".join(f"{s};{a:.3f};{b:.3f};{i:.1f};{q};{r:.2f}\r\n" for s, a, b, i, q, r in rows)
            file.write(text.replace(".", ","))


def read(who, path):
    """One reading in this process: seconds of the processor, and peak memory."""
    if who == "pandas":
        import pandas as pd

        start = time.process_time()
        found = len(pd.read_csv(path, sep=";", decimal=",", parse_dates=[0], encoding="utf-8"))
    else:
        import robthermal as rt

        rt.read_records({"time": [0, 1], "T1": [0, 1]}, outputs=["T1"])  # what is imported on first use is no reading
        names = {"inputs": ["m1", "heater", "room"], "outputs": ["T1", "T2"], "columns": COLUMNS}
        start = time.process_time()
        found = sum(part.n_samples for part in rt.read_records(path, max_bytes=2e9, **names))
    spent = time.process_time() - start
    print(found, spent, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)


def main(sizes):
    """Table of both readers."""
    header("Import of a logger's text file, six columns")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        for n in sizes:
            write(path, n)
            for who in ("pandas", "robthermal"):
                said = [subprocess.run([sys.executable, __file__, who, str(path)], capture_output=True, text=True,
                                       check=True).stdout.split() for _ in range(3 if n <= 1_000_000 else 1)]
                rows, spent, memory = min(said, key=lambda one: float(one[1]))
                size = path.stat().st_size / 1e6
                print(f"{who:<12} {int(rows):>9} rows, {size:6.0f} MB: {float(spent):7.2f} s of the processor, peak "
                      f"memory {float(memory) / 1e6:6.0f} MB", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] and sys.argv[1] in ("pandas", "robthermal"):
        read(sys.argv[1], sys.argv[2])
    else:
        main([int(float(text)) for text in sys.argv[1:]] or [100_000, 1_000_000])
