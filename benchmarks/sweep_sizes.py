"""Time and memory of sweeps of growing size, and the time to start one."""

import json
import os
import subprocess
import tempfile
import time
from pathlib import Path
from statistics import median

from benchmarks.measure import line, python, seconds_of
from benchmarks.swept import Sweeping, plan_of

SIZES = (1_000, 10_000, 100_000, 1_000_000)
START_CODE = """
import rbstab.sweep.sweep
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.plan.load import load_plan
factory_for("heyoka")(load_plan({plan!r}, ["integration.engine=heyoka"])).compute(0, 8)
"""
SMALL_PLAN = "base: {base}\nvary:\n  initial.angular_velocity[0]: {{linspace: [-40, 40, 64]}}\n"


def main() -> None:
    """Measure sweeps from a thousand members to a million, and the start of a small one."""
    _start()
    _sizes()
    for keep, samples in (("summary", 201), ("traces", 51)):
        code = f"from benchmarks.sweep_sizes import peak; peak({samples}, {keep!r})"
        done = subprocess.run(python(code), check=True, capture_output=True, text=True)
        what = f"sweep: peak memory, {SIZES[-1]} members, keep: {keep}"
        line(what, json.loads(done.stdout), "MB", "at most 600")


def _sizes() -> None:
    """Measure the time per member, and its ratio to the bare loop, since machine speed varies."""
    sweepings = {members: Sweeping(plan_of(members), 1) for members in SIZES}
    bare = sweepings[SIZES[-1]].bare_loop()
    taken: dict[int, list[tuple[float, float, float]]] = {members: [] for members in SIZES}

    def measure(members: int) -> None:
        # Small sweeps are short, so measure them several times.
        for _ in range(max(1, min(9, 30_000 // members))):
            before = bare()
            stored, gathered = sweepings[members].seconds()
            taken[members].append((stored, gathered, 2 * stored / (before + bare())))

    for turn in range(4):
        for members in SIZES[:-1]:
            measure(members)
        if turn % 2:
            measure(SIZES[-1])
    ratios = []
    for members, rows in taken.items():
        stored, gathered, loops = (median(column) / members for column in zip(*rows, strict=True))
        line(f"sweep: {members} members, one thread", 1e6 * stored, "µs", "each")
        line("  gathering them in one file", 1e6 * gathered, "µs", "each")
        line("  ratio to the bare loop beside it", loops, "", "")
        ratios.append(loops)
    line("  the longest of these to the shortest", max(ratios) / min(ratios), "", "at most 1.15")


def peak(samples: int, keep: str) -> None:
    """Print the peak memory of this process and its worker together, after a large sweep, MB."""
    sweeping = Sweeping(plan_of(SIZES[-1], samples, keep), 2)
    sweeping.seconds()
    # From /proc: the peak in `resource` starts with that of the parent process.
    pids = [os.getpid(), *sweeping.pids]
    statuses = [Path(f"/proc/{pid}/status").read_text() for pid in pids]
    peaks = [int(status.partition("VmHWM:")[2].split()[0]) for status in statuses]
    print(sum(peaks) * 1024 / 1e6)


def _start() -> None:
    """Time a process that imports and compiles all code of a sweep, then with heyoka's cache."""
    with tempfile.TemporaryDirectory() as home:
        case = Path("configs/paper/case2_visco_elastic.yaml").resolve()
        plan = Path(home) / "few.yaml"
        plan.write_text(SMALL_PLAN.format(base=case))
        code = START_CODE.format(plan=str(plan))
        for what, limit in (("first", "at most 3"), ("from the cache", "at most 1")):
            begin = time.perf_counter()
            subprocess.run(python(code), check=True, env={**os.environ, "HOME": home})
            line(f"sweep: import and compile, {what}", time.perf_counter() - begin, "s", limit)
        line("  the interpreter's own start", seconds_of(python("pass")), "s", "")
