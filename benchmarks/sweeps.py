"""Members of a sweep per second and core, against the bare batch loop and the SciPy engine."""

import time

from benchmarks.measure import by_turns, line
from benchmarks.swept import Sweeping, plan_of
from rbstab.config.build import problem_of
from rbstab.integrate.engines import engine

MEMBERS = 200_000


def main() -> None:
    """Measure visco-elastic members with 201 samples at a tolerance of 1e-8, to the disk."""
    plan = plan_of(MEMBERS)
    serial, parallel = Sweeping(plan, 1), Sweeping(plan, 2)
    problem = problem_of(plan.config_of(0))
    scipy = engine("scipy")

    def single() -> float:
        begin = time.perf_counter()
        scipy(problem)
        return time.perf_counter() - begin

    by_serial, by_parallel, by_loop, by_unsampled, by_scipy = by_turns(
        3,
        lambda: sum(serial.seconds()) / MEMBERS,
        lambda: sum(parallel.seconds()) / MEMBERS,
        serial.bare_loop(),
        serial.bare_loop(sampled=False),
        single,
    )
    line("sweep: 200,000 members to disk, one thread", 1 / by_serial, "1/s", "at least 10,000")
    line("  the bare batch loop", 1 / by_loop, "1/s", "")
    line("  the bare loop without samples", 1 / by_unsampled, "1/s", "")
    line("  ratio to the bare loop", by_loop / by_serial, "", "at least 0.8")
    line("  ratio to the scipy engine", by_scipy / by_serial, "", "at least 500")
    line("  two threads: ratio to one", by_serial / by_parallel, "", "at least 1.8")
