"""Speed of each engine, in runs per second."""

import time
from collections.abc import Callable

from benchmarks.measure import by_turns, line
from rbstab import load_config
from rbstab.config.build import problem_of
from rbstab.integrate.engines import engine
from rbstab.integrate.problem import Problem
from rbstab.integrate.straight_line.equations import audited_rates_of, forget_codes
from rbstab.mechanics.numbers import Array

CASE = "configs/paper/case2_visco_elastic.yaml"
RUNS = 300
EVALUATIONS = 2000


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
    line("  ratio", by_scipy / by_heyoka, "", "at least 50")
    measure_equations(problem)


def measure_equations(problem: Problem) -> None:
    """Measure one evaluation of the rates, by numpy and by the code that the scipy engine uses."""
    state = problem.audited_start()

    def seconds_to_evaluate(rates: Callable[[Array], Array]) -> float:
        begin = time.perf_counter()
        for _ in range(EVALUATIONS):
            rates(state)
        return (time.perf_counter() - begin) / EVALUATIONS

    def seconds_to_make() -> float:
        forget_codes()
        begin = time.perf_counter()
        audited_rates_of(problem.system)
        return time.perf_counter() - begin

    by_code = audited_rates_of(problem.system)
    numpy_time, code_time, making = by_turns(
        7,
        lambda: seconds_to_evaluate(problem.system.audited_rates),
        lambda: seconds_to_evaluate(by_code),
        seconds_to_make,
    )
    line("equations by numpy, one evaluation", 1e6 * numpy_time, "us", "")
    line("equations by the engine's code, one evaluation", 1e6 * code_time, "us", "")
    line("  ratio", numpy_time / code_time, "", "at least 8")
    line("making the code, in evaluations by numpy", making / numpy_time, "", "at most 200")
