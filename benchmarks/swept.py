"""Sweeps of visco-elastic members into a folder, with engines that are already compiled."""

import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from loky import ProcessPoolExecutor

from rbstab.config.load import load_config, resolved
from rbstab.integrate.heyoka.compiled_map import SIMD
from rbstab.sweep.execution.pools import Pool, Processes, Threads
from rbstab.sweep.execution.run import ShardRun
from rbstab.sweep.folder.members_file import digest_of_shards, write_members_file
from rbstab.sweep.folder.open_folder import open_folder
from rbstab.sweep.folder.shard_inventory import shard_inventory
from rbstab.sweep.members.engine import EngineFactory, MemberEngine
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.members.ensemble import EnsembleEngine
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.plan.plan import Plan

CASE = "configs/paper/case2_visco_elastic.yaml"
MAX_LOOP_MEMBERS = 8192
"""Members of the bare loop, a multiple of the batch size."""

INTEGRATION = ("integration.engine=heyoka", "integration.rtol=1e-8")


def plan_of(
    members: int,
    samples: int = 201,
    keep: str = "summary",
    integration: Sequence[str] = INTEGRATION,
) -> Plan:
    """Return a plan of members with random initial spins."""
    spin = {"uniform": [-40, 40]}
    base = resolved(load_config(CASE, [*integration, f"integration.samples={samples}"]))
    keys = [f"initial.angular_velocity[{axis}]" for axis in (0, 1)]
    vary = dict.fromkeys(keys, spin)
    drawn = {"design": "random", "members": members, "seed": 1}
    return load_plan({"base": base, "vary": vary, **drawn, "keep": keep})


class _LastingWorkers(Processes):
    """Worker processes that stay alive for the next sweep, with their engines."""

    def __init__(self, plan: Plan, count: int) -> None:
        super().__init__(count)
        super().begin(plan, warm_engine)
        while self.threads() < count:
            time.sleep(0.01)

    def begin(self, plan: Plan, factory: EngineFactory | None) -> None:
        """Keep the task, so that the workers keep their engines."""

    @property
    def pids(self) -> list[int]:
        """The ids of the processes."""
        assert isinstance(self.executor, ProcessPoolExecutor)
        return list(self.executor._processes)

    def close(self) -> None:
        """Leave the processes running; they end with this one."""


class _WarmThread(Threads):
    """A thread of this process whose engine is compiled."""

    def __init__(self, engine: MemberEngine) -> None:
        super().__init__()
        self._engine = engine

    def begin(self, plan: Plan, factory: EngineFactory | None) -> None:
        """Use the engine for every plan."""
        super().begin(plan, lambda _: self._engine)


def warm_engine(plan: Plan) -> MemberEngine:
    """Return an engine that has compiled its code."""
    engine = factory_for("heyoka")(plan)
    engine.compute(0, min(64, plan.members))
    return engine


class Sweeping:
    """A plan, and the compiled engines and worker processes that run it.

    Args:
        plan: The plan.
        threads: How many; each but the first has its own worker process.
    """

    def __init__(self, plan: Plan, threads: int) -> None:
        self.plan = plan
        self.engine = warm_engine(plan)
        self.pools: list[Pool] = [_WarmThread(self.engine)]
        self.pids: list[int] = []
        if threads > 1:
            workers = _LastingWorkers(plan, threads - 1)
            self.pools.append(workers)
            self.pids = workers.pids

    def bare_loop(self, *, sampled: bool = True) -> Callable[[], float]:
        """Return a timer of the integrator alone, without diagnostics or copies.

        The timer returns the seconds per member.

        Args:
            sampled: Whether the states are evaluated at the samples, or only at the end.
        """
        assert isinstance(self.engine, EnsembleEngine)
        batches = self.engine.variant_engines["visco-elastic"]
        count = min(MAX_LOOP_MEMBERS, self.plan.members)
        parameters, starts = batches.binding.parameters_and_starts(self.plan.values(0, count))
        ensemble = batches.ensemble
        integrator, given = ensemble._integrator, parameters[ensemble.open_indices]
        grid = np.repeat(ensemble.times[:, np.newaxis], SIMD, axis=1)

        def seconds() -> float:
            begin = time.perf_counter()
            for first in range(0, count, SIMD):
                integrator.set_time(0.0)
                integrator.pars[: len(given)] = given[:, first : first + SIMD]
                integrator.pars[len(given) :] = 1e3
                integrator.state[:] = 0.0
                integrator.state[: len(starts)] = starts[:, first : first + SIMD]
                if sampled:
                    integrator.propagate_grid(grid)
                else:
                    integrator.propagate_until(ensemble.times[-1])
            return (time.perf_counter() - begin) / count

        return seconds

    def seconds(self, *, gathered: bool = True) -> tuple[float, float]:
        """Return the seconds to compute and store all shards, and the seconds to gather them.

        The comparison with scipy is left out.

        Args:
            gathered: Whether to gather the shards at all.
        """
        with (
            tempfile.TemporaryDirectory(dir="results") as folder,
            open_folder(Path(folder) / "sweep", self.plan, None) as place,
        ):
            inventory = shard_inventory(place.folder)
            begin = time.perf_counter()
            ShardRun(self.plan, place.folder, self.pools).compute(inventory)
            stored = time.perf_counter()
            if gathered:
                write_members_file(self.plan, place.folder, digest_of_shards(inventory), None)
            return stored - begin, time.perf_counter() - stored
