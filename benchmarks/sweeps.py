"""How many members of a sweep one core makes, against the bare batch loop and the SciPy engine."""

import time

import numpy as np

from benchmarks.measure import by_turns, line
from benchmarks.swept import Sweeping, plan_of
from rbstab.config.build import problem_of
from rbstab.integrate.engines import engine
from rbstab.integrate.ensemble import Ensemble
from rbstab.sweep.ensemble import EnsembleEngine

MEMBERS = 200_000
LOOPED = 8192
"""Members of the bare loop."""


def main() -> None:
    """Measures visco-elastic members with 201 samples at a tolerance of 1e-8, to the disk."""
    plan = plan_of(MEMBERS)
    one, two = Sweeping(plan, 1), Sweeping(plan, 2)
    members = one.engine
    assert isinstance(members, EnsembleEngine)
    structure = members.structures["visco-elastic"]
    parameters, starts = structure.binding.of(plan.values(0, LOOPED))
    problem = problem_of(plan.config_of(0))
    scipy = engine("scipy")

    def single() -> float:
        begin = time.perf_counter()
        scipy(problem)
        return time.perf_counter() - begin

    by_one, by_two, by_loop, by_scipy = by_turns(
        3,
        lambda: sum(one.seconds()) / MEMBERS,
        lambda: sum(two.seconds()) / MEMBERS,
        lambda: _bare(structure.ensemble, parameters, starts),
        single,
    )
    line("sweep: 200,000 members to disk, one thread", 1 / by_one, "1/s", "at least 10,000")
    line("  the bare batch loop", 1 / by_loop, "1/s", "")
    line("  ratio to the bare loop", by_loop / by_one, "", "at least 0.33")
    line("  ratio to the scipy engine", by_scipy / by_one, "", "at least 3000")
    line("  two threads: ratio to one", by_one / by_two, "", "at least 1.7")


def _bare(ensemble: Ensemble, parameters: object, starts: object) -> float:
    """Seconds a member of the integrator alone: no diagnostics, nothing copied out."""
    integrator, batch = ensemble.integrator, ensemble.batch
    given, begun = np.asarray(parameters)[ensemble.open], np.asarray(starts)
    begin = time.perf_counter()
    for first in range(0, LOOPED, batch):
        integrator.set_time(0.0)
        integrator.pars[: len(given)] = given[:, first : first + batch]
        integrator.pars[len(given) :] = 1e3
        integrator.state[:] = 0.0
        integrator.state[: len(begun)] = begun[:, first : first + batch]
        integrator.propagate_grid(ensemble.grid)
    return (time.perf_counter() - begin) / LOOPED
