"""How many members of a sweep one core makes, against the bare batch loop and the SciPy engine."""

import time

import numpy as np

from benchmarks.measure import by_turns, line
from rbstab.config.build import problem_of
from rbstab.integrate.engines import engine
from rbstab.integrate.ensemble import Ensemble
from rbstab.sweep.ensemble import EnsembleEngine
from rbstab.sweep.load import load_plan
from rbstab.sweep.single import SingleRuns

PLAN = "configs/sweeps/stability_map_visco_elastic.yaml"
CHANGES = ["integration.samples=201", "integration.rtol=1e-8"]
MEMBERS = 2048


def main() -> None:
    """Measures visco-elastic members with 201 samples at a tolerance of 1e-8, on one core."""
    plan = load_plan(PLAN, CHANGES)
    start = plan.members // 3

    begin = time.perf_counter()
    members = EnsembleEngine(plan, SingleRuns(plan, "heyoka"))
    line("sweep: tracing and compiling", time.perf_counter() - begin, "s", "at most 3")
    structure = members.structures["visco-elastic"]
    parameters, starts = structure.binding.of(plan.values(start, start + MEMBERS))
    problem = problem_of(plan.config_of(start))
    scipy = engine("scipy")

    def whole() -> float:
        begin = time.perf_counter()
        members.compute(start, start + MEMBERS)
        return (time.perf_counter() - begin) / MEMBERS

    def bare() -> float:
        return _bare(structure.ensemble, parameters, starts)

    def single() -> float:
        begin = time.perf_counter()
        scipy(problem)
        return time.perf_counter() - begin

    by_sweep, by_loop, by_scipy = by_turns(5, whole, bare, single)
    line("sweep: members with all diagnostics", 1 / by_sweep, "runs/s", "at least 10,000 a core")
    line("  the bare batch loop", 1 / by_loop, "runs/s", "")
    line("  ratio to the bare loop", by_loop / by_sweep, "", "at least 0.33")
    line("  ratio to the scipy engine", by_scipy / by_sweep, "", "at least 3000")


def _bare(ensemble: Ensemble, parameters: object, starts: object) -> float:
    """Seconds a member of the integrator alone: no diagnostics, nothing copied out."""
    integrator, batch = ensemble.integrator, ensemble.batch
    given, begun = np.asarray(parameters)[ensemble.open], np.asarray(starts)
    begin = time.perf_counter()
    for first in range(0, MEMBERS, batch):
        integrator.set_time(0.0)
        integrator.pars[: len(given)] = given[:, first : first + batch]
        integrator.pars[len(given) :] = 1e3
        integrator.state[:] = 0.0
        integrator.state[: len(begun)] = begun[:, first : first + batch]
        integrator.propagate_grid(ensemble.grid)
    return (time.perf_counter() - begin) / MEMBERS
