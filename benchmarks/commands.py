"""Wall time of `rbstab sweep` as whole processes, from a thousand members to a million."""

import json
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from benchmarks.measure import line, python, seconds_of
from benchmarks.swept import CASE

RBSTAB = [sys.executable, "-m", "rbstab_cli"]
LIMITS = {1_000: (1.2, 5), 40_000: (4.0, 2), 1_000_000: (45.0, 1)}
"""For each number of members: the limit, s, and how often it is measured."""

KEYS = [f"initial.angular_velocity[{axis}]" for axis in (0, 1)]


def main() -> None:
    """Measure visco-elastic members with 401 samples at the default tolerances, on all cores."""
    importing = median(seconds_of(python("import scipy.integrate, h5py")) for _ in range(5))
    line("importing scipy.integrate and h5py", importing, "s", "0.44 where the limits were set")
    each = []
    for members, (limit, times) in LIMITS.items():
        seconds = median(_seconds(members) for _ in range(times))
        each.append((seconds - 1.0) / members)
        line(f"rbstab sweep of {members} members", seconds, "s", f"at most {limit:g}")
        line("  each, beyond the first second", 1e6 * each[-1], "µs", "")
    line("  the longest of the last two to the other", max(each[1:]) / min(each[1:]), "", "1.15")


def _seconds(members: int) -> float:
    with tempfile.TemporaryDirectory(dir="results") as folder:
        plan = Path(folder) / "plan.yaml"
        content = {
            "base": str(Path(CASE).resolve()),
            "vary": {key: {"uniform": [-40, 40]} for key in KEYS},
            "design": "random",
            "members": members,
            "seed": 1,
        }
        plan.write_text(json.dumps(content))
        begin = time.perf_counter()
        seconds_of([*RBSTAB, "sweep", "--no-prove", str(plan), "-o", folder, "-q"])
        return time.perf_counter() - begin
