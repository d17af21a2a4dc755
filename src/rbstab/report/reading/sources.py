"""What a report is made from: the results that could be read."""

import os
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from rbstab.config.schema import Config
from rbstab.experiment.summary import Summary, summary_of, without_work
from rbstab.report.model.document import Unread
from rbstab.report.model.words import untrusted
from rbstab.report.reading.read_results import ReadRun, ReadSweep, read_all
from rbstab.report.reading.untrusted import file_of
from rbstab.store.errors import StoreError
from rbstab.store.result import Result
from rbstab.sweep.members.outcome import settling_times

MAX_LABEL_LENGTH = 48
"""Characters: it stands in legends."""


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
        data: The same as plain data, whatever it says; empty where it is no YAML.
    """

    number: int
    name: str
    label: str
    path: Path
    result: Result
    config: Config | None
    data: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def summary(self) -> Summary:
        """Its ends, its audit, its peaks."""
        return summary_of(self.result)

    @property
    def counts_work(self) -> bool:
        """Whether the result has v - ε in place of v (on s = F + κE)."""
        v = self.result["lyapunov"]
        return not np.array_equal(without_work(self.result), v, equal_nan=True)

    @cached_property
    def settling_time(self) -> float:
        """From when v stays below v(0)/1000, s; NaN where it does not by the end."""
        with np.errstate(all="ignore"):
            v = without_work(self.result)
            return float(settling_times(self.result["time"], v[np.newaxis])[0])


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


def read_sources(paths: Iterable[str | Path]) -> Sources:
    """Reads results; what cannot be read is listed with the reason, and the rest is read.

    Args:
        paths: Files of runs, folders of sweeps, or the files that gather these. One that is named
            twice is taken once.
    """
    wanted: dict[str, Path] = {}
    for path in map(Path, paths):
        wanted.setdefault(_identity(path), path)
    runs: list[ReadRun] = []
    sweeps: list[Path] = []
    unread: list[Unread] = []
    for found in read_all(list(wanted.values())):
        if isinstance(found, Unread):
            unread.append(found)
        elif isinstance(found, ReadSweep):
            sweeps.append(found.file)
        else:
            runs.append(found)
    return Sources(_runs(runs), _sweeps(sweeps), tuple(unread))


def _identity(path: Path) -> str:
    """The same for every name of a result."""
    try:
        return os.path.realpath(file_of(path))
    except (StoreError, OSError, ValueError):
        return os.path.abspath(path)  # noqa: PTH100 (`Path.absolute` keeps "..")


def _runs(found: list[ReadRun]) -> tuple[Run, ...]:
    labels = unique_labels([read.file for read in found])
    return tuple(
        Run(number, f"run-{number + 1}", label, read.file, read.result, *read.stored)
        for number, (label, read) in enumerate(zip(labels, found, strict=True))
    )


def _sweeps(found: list[Path]) -> tuple[SweepFile, ...]:
    # The file of every sweep has the same name; that of its folder tells them apart.
    labels = unique_labels([file.absolute().parent for file in found])
    return tuple(
        SweepFile(number, f"sweep-{number + 1}", label, file)
        for number, (label, file) in enumerate(zip(labels, found, strict=True))
    )


def unique_labels(paths: list[Path]) -> list[str]:
    """The names of files without their endings, with the folders that it takes to tell them apart.

    Of a long name the end is cut off; what cannot be told apart any more is numbered.
    """
    parts = [(*path.absolute().parts[1:-1], path.stem) for path in paths]
    depths = [1] * len(parts)
    labels = [part[-1] for part in parts]
    while True:
        counts = Counter(labels)
        clashing = [
            k for k, part in enumerate(parts) if counts[labels[k]] > 1 and depths[k] < len(part)
        ]
        if not clashing:
            break
        for k in clashing:
            depths[k] += 1
            labels[k] = "/".join(parts[k][-depths[k] :])
    short = [untrusted(label, MAX_LABEL_LENGTH) for label in labels]
    counts, used = Counter(short), Counter[str]()
    for k, label in enumerate(short):
        if counts[label] > 1:
            used[label] += 1
            short[k] = f"{label} ({used[label]})"
    return short
