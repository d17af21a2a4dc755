"""Speed of a sliding connector in the compiled engine: switches, and members of a sweep."""

import time
from collections.abc import Callable
from dataclasses import replace

from benchmarks.measure import by_turns, line
from rbstab import load_config
from rbstab.config.build import problem_of
from rbstab.integrate.heyoka.engine import integrate
from rbstab.integrate.problem import Problem
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.load import load_plan

CASE = "configs/examples/sliding/position_exact_20000.yaml"
SETTINGS = ["integration.duration=4", "integration.samples=1001"]
SWITCHES = 100_000

PLAN = "configs/sweeps/variants.yaml"
MEMBERS = 20
"""Sliding members that are computed in each turn; they are the last variant of the plan."""


def main() -> None:
    """Measure the chatter of the paper's body on s = E with K_s = 20,000 N.

    It is one run, without the second run that gives `trusted_until`.
    """
    problem = problem_of(load_config(CASE, SETTINGS))
    assert problem.switching is not None
    switching = replace(problem.switching, switch_limit=SWITCHES, stick_energy=0.0)
    problem = replace(problem, switching=switching, diagnosed=False)
    clock: list[tuple[int, float]] = []

    def whole_run() -> float:
        clock[:] = _switch_times(problem)
        return _seconds_per_switch(clock, 0.0, 1.0)

    each, early, late = by_turns(
        5,
        whole_run,
        lambda: _seconds_per_switch(clock, 0.0, 0.25),
        lambda: _seconds_per_switch(clock, 0.75, 1.0),
    )
    line("heyoka: s = E, 20,000 N, 100,000 switches", 1 / each, "1/s", "at least 50,000")
    line("  rate of the last quarter to that of the first", early / late, "", "about 1")
    _members()


def _members() -> None:
    """Measure the sliding members of a sweep, and how much of their time the motion takes."""
    plan = load_plan(PLAN)
    runs, first = SingleRuns(plan), plan.members - MEMBERS
    assert plan.config_of(first).controller.variant == "sliding"
    problems = [
        replace(problem_of(plan.config_of(member)), diagnosed=False)
        for member in range(first, plan.members)
    ]

    def motions() -> None:
        for problem in problems:
            integrate(problem)

    def members() -> None:
        runs.compute(first, plan.members)

    whole, alone = by_turns(5, lambda: _seconds_of(members), lambda: _seconds_of(motions))
    line("heyoka: sliding members of variants.yaml", MEMBERS / whole, "1/s", "at least 15")
    line("  time of their integrations to the whole time", alone / whole, "", "about 0.5")


def _seconds_of(call: Callable[[], object]) -> float:
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


def _switch_times(problem: Problem) -> list[tuple[int, float]]:
    """Return the switches so far and the wall time, s, at each sample of one run."""
    clock: list[float] = []
    times = problem.times.tolist()

    def told(t: float) -> None:
        while len(clock) < len(times) and times[len(clock)] <= t:
            clock.append(time.perf_counter())

    run = integrate(problem, told)
    assert run.switches is not None
    counts = run.switches.counts.sum(axis=1).tolist()
    return list(zip(counts, clock, strict=False))


def _seconds_per_switch(clock: list[tuple[int, float]], begin: float, end: float) -> float:
    """Return the seconds per switch between two fractions of all switches (nearest samples)."""
    total = clock[-1][0]
    (first, start), (last, stop) = (
        min((abs(row[0] - part * total), row) for row in clock)[1] for part in (begin, end)
    )
    return (stop - start) / (last - first)
