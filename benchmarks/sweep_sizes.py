"""What a sweep takes as it grows, in time and memory, and what it takes to begin."""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.measure import line, python, seconds_of
from benchmarks.swept import Sweeping, plan_of

SIZES = (1_000, 10_000, 100_000, 1_000_000)
FEW = "base: {base}\nvary:\n  initial.angular_velocity[0]: {{linspace: [-40, 40, 64]}}\n"


def main() -> None:
    """Measures sweeps from a thousand members to a million, and the beginning of a small one."""
    _beginning()
    for members in SIZES:
        sweeping = Sweeping(plan_of(members), 2)
        rounds = 7 if members < SIZES[-1] else 1
        taken = sorted(sweeping.seconds() for _ in range(rounds))[rounds // 2]
        stored, gathered = (1e6 * seconds / members for seconds in taken)
        line(f"sweep: {members} members, two threads", stored, "µs", "each, within 15 %")
        line("  gathering them in one file", gathered, "µs", "each")
    for keep, samples in (("summary", 201), ("traces", 11)):
        code = f"from benchmarks.sweep_sizes import peak; peak({samples}, {keep!r})"
        done = subprocess.run(python(code), check=True, capture_output=True, text=True)
        what = f"sweep: peak memory, {SIZES[-1]} members, keep: {keep}"
        line(what, json.loads(done.stdout), "MB", "at most 600")


def peak(samples: int, keep: str) -> None:
    """Prints the peak memory of this process after a sweep of the largest size, MB."""
    # Only where processes have such a number.
    import resource

    Sweeping(plan_of(SIZES[-1], samples, keep), 2).seconds()
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6)


def _beginning() -> None:
    """A sweep that has to import and compile everything, the same from heyoka's cache."""
    with tempfile.TemporaryDirectory() as home:
        plan = Path(home) / "few.yaml"
        plan.write_text(FEW.format(base=Path("configs/paper/case2_visco_elastic.yaml").resolve()))
        for what, limit in (("first", "at most 3"), ("from the cache", "at most 1")):
            code = f"from benchmarks.sweep_sizes import begin; begin({str(plan)!r})"
            done = subprocess.run(
                python(code),
                check=True,
                capture_output=True,
                text=True,
                env={**os.environ, "HOME": home},
            )
            line(f"sweep: import and compile, {what}", float(done.stdout), "s", limit)
        line("  of which the interpreter's own start", seconds_of(python("pass")), "s", "")


def begin(plan: str) -> None:
    """Prints what a sweep takes until its engine is ready, s."""
    before = time.perf_counter()
    # Imports are what is measured.
    from rbstab.sweep.engine import factory_for
    from rbstab.sweep.load import load_plan
    from rbstab.sweep.sweep import sweep_to_folder

    assert sweep_to_folder
    made = factory_for("heyoka")(load_plan(plan, ["integration.engine=heyoka"]))
    made.compute(0, 8)
    print(time.perf_counter() - before, file=sys.stdout)
