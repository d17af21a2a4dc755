"""Speed of each engine, in runs per second."""

import time

from benchmarks.measure import by_turns, line
from rbstab import load_config
from rbstab.config.build import problem_of
from rbstab.integrate.engines import engine

CASE = "configs/paper/case2_visco_elastic.yaml"
RUNS = 300


def main() -> None:
    """Measure both engines on the visco-elastic case with 201 samples and default tolerances."""
    problem = problem_of(load_config(CASE, ["integration.samples=201"]))
    scipy, heyoka = engine("scipy"), engine("heyoka")

    begin = time.perf_counter()
    heyoka(problem)
    line("heyoka: first run, with tracing and compiling", time.perf_counter() - begin, "s", "")

    def slow() -> float:
        begin = time.perf_counter()
        scipy(problem)
        return time.perf_counter() - begin

    def fast() -> float:
        begin = time.perf_counter()
        for _ in range(RUNS):
            heyoka(problem)
        return (time.perf_counter() - begin) / RUNS

    by_scipy, by_heyoka = by_turns(7, slow, fast)
    line("scipy: visco-elastic, 201 samples", 1 / by_scipy, "runs/s", "")
    line("heyoka: the same", 1 / by_heyoka, "runs/s", "")
    line("  ratio", by_scipy / by_heyoka, "", "at least 300")
