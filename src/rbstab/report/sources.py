"""What a report is made from: the results that could be read."""

from dataclasses import dataclass
from pathlib import Path

from rbstab.config.schema import Config
from rbstab.report.document import Unread
from rbstab.store.result import Result


@dataclass(frozen=True, eq=False)
class Run:
    """A single run.

    Args:
        number: Its number among the runs, from 0: that of its colour.
        name: Its own in a report, for anchors: "run-1".
        label: What legends and tables call it, its own among the runs; the name of its file.
        path: Its file.
        result: What is in it.
        config: Its config, or None where this version of the program cannot read that.
    """

    number: int
    name: str
    label: str
    path: Path
    result: Result
    config: Config | None


@dataclass(frozen=True)
class SweepFile:
    """A sweep; of its columns only those are read that are wanted (`rbstab.store.read_table`).

    Args:
        number: Its number among the sweeps, from 0.
        name: Its own in a report, for anchors: "sweep-1".
        label: What tables call it, its own among the sweeps; the name of its folder.
        path: The file that gathers it.
    """

    number: int
    name: str
    label: str
    path: Path


@dataclass(frozen=True)
class Sources:
    """All that a report is made from.

    Args:
        runs: In the order in which they were named.
        sweeps: Likewise.
        unread: What could not be read, and why.
    """

    runs: tuple[Run, ...]
    sweeps: tuple[SweepFile, ...]
    unread: tuple[Unread, ...]
