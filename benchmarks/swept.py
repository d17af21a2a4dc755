"""A sweep of visco-elastic members into a folder, by engines that are compiled beforehand."""

import tempfile
import time
from pathlib import Path

from rbstab.config.load import load_config, resolved
from rbstab.sweep.begin import begun
from rbstab.sweep.engine import MemberEngine, factory_for
from rbstab.sweep.execute import Execution, survey_of
from rbstab.sweep.gather import digest_of_shards, gather
from rbstab.sweep.load import load_plan
from rbstab.sweep.plan import Plan

CASE = "configs/paper/case2_visco_elastic.yaml"
INTEGRATION = ["integration.engine=heyoka", "integration.rtol=1e-8"]


def plan_of(members: int, samples: int = 201, keep: str = "summary") -> Plan:
    """Members with random initial spins."""
    spin = {"uniform": [-40, 40]}
    base = resolved(load_config(CASE, [*INTEGRATION, f"integration.samples={samples}"]))
    keys = [f"initial.angular_velocity[{axis}]" for axis in (0, 1)]
    vary = dict.fromkeys(keys, spin)
    drawn = {"design": "random", "members": members, "seed": 1}
    return load_plan({"base": base, "vary": vary, **drawn, "keep": keep})


class Compiled:
    """Engines for some threads, handed out again and again.

    Args:
        threads: How many.
    """

    def __init__(self, threads: int) -> None:
        make = factory_for("heyoka")
        plan = plan_of(1000)
        self.engines = [make(plan) for _ in range(threads)]
        for engine in self.engines:
            engine.compute(0, 64)
        self.free = list(self.engines)

    def __call__(self, plan: Plan) -> MemberEngine:
        """An engine for a plan of the same structure."""
        engine = self.free.pop()
        engine.plan = plan  # type: ignore[attr-defined]
        return engine

    def seconds(self, plan: Plan) -> float:
        """How long all shards take to the disk, and to be gathered; without the comparison."""
        self.free = list(self.engines)
        with (
            tempfile.TemporaryDirectory(dir="results") as folder,
            begun(Path(folder) / "sweep", plan, None) as place,
        ):
            survey = survey_of(place.folder)
            begin = time.perf_counter()
            Execution(plan, place.folder, self, len(self.engines)).run(survey)
            gather(plan, place.folder, digest_of_shards(survey), None)
            return time.perf_counter() - begin
