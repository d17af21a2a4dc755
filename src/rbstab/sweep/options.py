"""How a sweep is run."""

from dataclasses import dataclass

from rbstab.sweep.execution.work_queue import Executor
from rbstab.sweep.folder.parts import Part
from rbstab.sweep.members.engine import EngineFactory


@dataclass(frozen=True)
class SweepOptions:
    """How a sweep is run; the results do not depend on it.

    Args:
        factory: Makes the engine of each thread, all in this process. Default: the engine of the
            plan, with the first thread in this process and each other in a worker process.
        threads: How many threads; default as many as there are processors.
        shard_size: Members of a shard; default that of the folder, or a good one.
        retry_failed: Run shards with failed members again.
        fail_fast: Stop at the first member that failed.
        force: Move a different sweep of the same name aside; not for a part.
        part: Run this part only, and gather nothing; default all.
        executor: Runs the shards, in place of threads.

    Raises:
        ValueError: threads or shard_size is below 1.
    """

    factory: EngineFactory | None = None
    threads: int | None = None
    shard_size: int | None = None
    retry_failed: bool = False
    fail_fast: bool = False
    force: bool = False
    part: Part | None = None
    executor: Executor | None = None

    def __post_init__(self) -> None:
        """Reject zero: no threads would hang, an empty shard would never finish."""
        for name, count in (("threads", self.threads), ("shard_size", self.shard_size)):
            if count is not None and count < 1:
                raise ValueError(f"{name} is {count} (expected at least 1)")
