"""The sources of a report: the results that could be read."""

import os
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from rbstab.config.schema import Config
from rbstab.experiment.summary import (
    Summary,
    settling_time_of,
    stores_v_minus_work,
    summary_of,
)
from rbstab.report.model.document import Unread
from rbstab.report.model.words import untrusted
from rbstab.report.reading.answers import Answers
from rbstab.report.reading.read_results import ReadRun, ReadSweep, read_all
from rbstab.report.reading.untrusted import file_of
from rbstab.store.errors import StoreError
from rbstab.store.result import Result

MAX_LABEL_LENGTH = 48
"""Maximum number of characters of a label; labels must fit in legends."""


@dataclass(frozen=True, eq=False)
class Run:
    """A single run.

    Args:
        number: The number of its colour: its number among the runs, from 0, if these are few.
        name: Its anchor, unique in a report: "run-1".
        label: Its name in legends and tables, unique among the runs; from the name of its file.
        path: Its file.
        result: The content of the file.
        config: Its config; None if this version of the program cannot read it.
        data: The stored config as plain data, not validated; empty if it is not YAML.
        known_summary: Its summary, if it was computed already.
        known_answers: The answers about it, if they were computed already.
        legend: The entry in legends that it shares with others, in grey; "" if it has its own.
    """

    number: int
    name: str
    label: str
    path: Path
    result: Result
    config: Config | None
    data: Mapping[str, Any] = field(default_factory=dict)
    known_summary: Summary | None = None
    known_answers: Answers | None = None
    legend: str = ""

    @cached_property
    def summary(self) -> Summary:
        """Its summary: first and last values of v, energy residual, peaks."""
        return self.known_summary or summary_of(self.result)

    @cached_property
    def stores_v_minus_work(self) -> bool:
        """Whether the result stores v - ε in place of v (on s = F + κE)."""
        return stores_v_minus_work(self.result)

    @property
    def is_driven(self) -> bool:
        """Whether inputs supply power to the body."""
        return "supplied_power" in self.result and "supplied_energy" in self.result

    @cached_property
    def settling_time(self) -> float:
        """The time from which v stays below v(0)/1000, s; NaN if the run has not settled."""
        return settling_time_of(self.result)


@dataclass(frozen=True)
class SweepFile:
    """A sweep; the report reads only the columns that it needs (`read_sweep`).

    Args:
        number: Its number among the sweeps, from 0.
        name: Its anchor, unique in a report: "sweep-1".
        label: Its name in tables, unique among the sweeps; from the name of its folder.
        path: Its members file.
    """

    number: int
    name: str
    label: str
    path: Path


@dataclass(frozen=True)
class Sources:
    """The sources of a report.

    Args:
        runs: The runs, in the order in which the user named them.
        sweeps: The sweeps, in the same order.
        unread: The results that could not be read, with the reasons.
    """

    runs: tuple[Run, ...]
    sweeps: tuple[SweepFile, ...]
    unread: tuple[Unread, ...]


def read_sources(paths: Iterable[str | Path]) -> Sources:
    """Read results; those that cannot be read are listed with the reasons.

    Args:
        paths: Files of runs, folders of sweeps, or members files of sweeps. Duplicates are
            ignored.
    """
    unique: dict[str, Path] = {}
    for path in map(Path, paths):
        unique.setdefault(_identity(path), path)
    runs: list[ReadRun] = []
    sweeps: list[Path] = []
    unread: list[Unread] = []
    for found in read_all(list(unique.values())):
        if isinstance(found, Unread):
            unread.append(found)
        elif isinstance(found, ReadSweep):
            sweeps.append(found.file)
        else:
            runs.append(found)
    return Sources(_runs(runs), _sweeps(sweeps), tuple(unread))


def _identity(path: Path) -> str:
    """Return a key that is equal for all paths to the same result."""
    try:
        return os.path.realpath(file_of(path))
    except (StoreError, OSError, ValueError):
        return os.path.abspath(path)  # noqa: PTH100 (`Path.absolute` keeps "..")


def _runs(found: list[ReadRun]) -> tuple[Run, ...]:
    labels = unique_labels([read.file for read in found])
    return tuple(
        Run(
            number,
            f"run-{number + 1}",
            label,
            read.file,
            read.result,
            *read.stored,
            known_summary=read.summary,
            known_answers=read.answers,
        )
        for number, (label, read) in enumerate(zip(labels, found, strict=True))
    )


def _sweeps(found: list[Path]) -> tuple[SweepFile, ...]:
    # All sweep files have the same name; only the names of their folders differ.
    labels = unique_labels([file.absolute().parent for file in found])
    return tuple(
        SweepFile(number, f"sweep-{number + 1}", label, file)
        for number, (label, file) in enumerate(zip(labels, found, strict=True))
    )


def unique_labels(paths: list[Path]) -> list[str]:
    """Return unique labels: file names without suffix; folders are added if names are equal.

    Long labels are cut at the end. Labels that are equal after the cut are numbered.
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
