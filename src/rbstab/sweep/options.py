"""Options for running a sweep."""

from dataclasses import dataclass

from rbstab.sweep.execution.pools import Pool
from rbstab.sweep.folder.open_folder import Part
from rbstab.sweep.members.engine import EngineFactory


@dataclass(frozen=True)
class SweepOptions:
    """Options for running a sweep. They do not affect its results.

    Args:
        factory: Makes the engine of each thread; all threads then compute in this process, if there
            is no `pool`. By default the engine is that of the plan, the first thread computes in
            this process, and every other thread is a worker process.
        threads: The number of threads; default the number of processors.
        shard_size: Members per shard; default the size used in the folder, or else a computed size.
        retry_failed: Run shards with failed members again.
        fail_fast: Stop at the first member that failed.
        force: Rename the folder of a different sweep with the same name; not for a part.
        part: Run only this part, without finishing the sweep; by default the whole sweep is run.
        pool: Computes the members, instead of threads and processes of this machine.
        compare: How many members are run again by SciPy; default 4 (`members_to_compare`).

    Raises:
        ValueError: threads, shard_size or compare is below 1.
    """

    factory: EngineFactory | None = None
    threads: int | None = None
    shard_size: int | None = None
    retry_failed: bool = False
    fail_fast: bool = False
    force: bool = False
    part: Part | None = None
    pool: Pool | None = None
    compare: int | None = None

    def __post_init__(self) -> None:
        """Reject zero: no threads would hang, an empty shard would never finish."""
        for name in ("threads", "shard_size", "compare"):
            count = getattr(self, name)
            if count is not None and count < 1:
                raise ValueError(f"{name} is {count} (expected at least 1)")
