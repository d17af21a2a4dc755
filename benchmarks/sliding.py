"""Switches of a sliding connector that the compiled engine computes per second."""

import time
from dataclasses import replace

from benchmarks.measure import by_turns, line
from rbstab import load_config
from rbstab.config.build import problem_of
from rbstab.integrate.heyoka.flow import HeyokaFlow
from rbstab.integrate.problem import Problem
from rbstab.integrate.switching.filippov import FilippovDriver

CASE = "configs/examples/sliding/position_exact_20000.yaml"
SETTINGS = ["integration.duration=4", "integration.samples=1001"]
SWITCHES = 100_000


def main() -> None:
    """Measure the chatter of the paper's body on s = E with K_s = 20,000 N.

    It is one run of the driver, without the second run that gives `trusted_until`.
    """
    problem = problem_of(load_config(CASE, SETTINGS))
    assert problem.switching is not None
    switching = replace(problem.switching, switch_limit=SWITCHES, stick_energy=0.0)
    problem = replace(problem, switching=switching)
    flow = HeyokaFlow(problem, switching)
    clock: list[tuple[int, float]] = []

    def whole_run() -> float:
        clock[:] = _switch_times(problem, flow)
        return _seconds_per_switch(clock, 0.0, 1.0)

    each, early, late = by_turns(
        5,
        whole_run,
        lambda: _seconds_per_switch(clock, 0.0, 0.25),
        lambda: _seconds_per_switch(clock, 0.75, 1.0),
    )
    line("heyoka: s = E, 20,000 N, 100,000 switches", 1 / each, "1/s", "at least 50,000")
    line("  rate of the last quarter to that of the first", early / late, "", "about 1")


def _switch_times(problem: Problem, flow: HeyokaFlow) -> list[tuple[int, float]]:
    """Return the switches so far and the wall time, s, at each sample of one run."""
    assert problem.switching is not None
    driver = FilippovDriver(problem, problem.switching, flow)
    return [(sum(sample.counts), time.perf_counter()) for sample in driver.samples()]


def _seconds_per_switch(clock: list[tuple[int, float]], begin: float, end: float) -> float:
    """Return the seconds per switch between two fractions of all switches (nearest samples)."""
    total = clock[-1][0]
    (first, start), (last, stop) = (
        min(clock, key=lambda row, part=part: abs(row[0] - part * total)) for part in (begin, end)
    )
    return (stop - start) / (last - first)
