"""The sources of a report: the results that could be read.

A result that cannot be read raises no error: it is returned as `Unread`.
"""

import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Self

from rbstab.experiment.answers.assessed_run import AssessedRun
from rbstab.experiment.proof_cache import cached_proof
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.stored_run import stored_config
from rbstab.processes.mapped import mapped
from rbstab.report.model.document import Unread
from rbstab.report.model.words import untrusted
from rbstab.report.reading.untrusted import file_of, result_of
from rbstab.store.errors import StoreError

MAX_LABEL_LENGTH = 48
"""Maximum number of characters of a label; labels must fit in legends."""


@dataclass
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


@dataclass(eq=False)
class Run(AssessedRun):
    """A single run of a report.

    Args:
        path: Its file.
        result: The content of the file.
        config: Its config; None if this version of the program cannot read it.
        data: The stored config as plain data, not validated; empty if it is not YAML.
        number: The number of its colour: its number among the runs, from 0, if these are few.
        name: Its anchor, unique in a report: "run-1".
        label: Its name in legends and tables, unique among the runs; from the name of its file.
        legend: The entry in legends that it shares with others, in grey; "" if it has its own.
    """

    data: Mapping[str, Any] = field(default_factory=dict)
    number: int = 0
    name: str = ""
    label: str = ""
    legend: str = ""

    @cached_property
    def proof(self) -> "Proof | None":
        """As of an assessed run; but a report says it if the disk reports an error."""
        return None if self.config is None else cached_proof(self.path.parent, self.config)


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

    @classmethod
    def of(cls, results: Iterable[Run | SweepFile | Unread]) -> Self:
        """Return the sources among some results."""
        every = list(results)
        return cls(
            tuple(result for result in every if isinstance(result, Run)),
            tuple(result for result in every if isinstance(result, SweepFile)),
            tuple(result for result in every if isinstance(result, Unread)),
        )


def read_sources(paths: Iterable[str | Path]) -> Sources:
    """Read results, many of them in several processes; those that cannot be read have reasons.

    Args:
        paths: Files of runs, folders of sweeps, or members files of sweeps. Duplicates are
            ignored.
    """
    unique: dict[str, Path] = {}
    for path in map(Path, paths):
        unique.setdefault(_identity(path), path)
    sources = Sources.of(mapped(read_path, list(unique.values())))
    _name("run", sources.runs, [run.path for run in sources.runs])
    # All sweep files have the same name; only the names of their folders differ.
    _name("sweep", sources.sweeps, [sweep.path.absolute().parent for sweep in sources.sweeps])
    return sources


def read_path(path: Path) -> Run | SweepFile | Unread:
    """Read a result, without the names that tell it from others."""
    try:
        file = file_of(path)
        result = result_of(file)
        if result is None:
            return SweepFile(0, "", "", file)
        run = Run(file, result, *stored_config(result))
    except Exception as error:
        # Whatever a file contains, the others are still reported.
        return Unread(untrusted(path), _reason(path, error))
    # What takes long is found here, by several processes. Where it fails, the report finds it again
    # with its error.
    with suppress(Exception):
        _ = run.summary, run.answer, run.checks
    return run


def _reason(path: Path, error: Exception) -> str:
    """Return the message of an error without the path, which is shown beside it."""
    expected = isinstance(error, StoreError | OSError | ValueError)
    text = str(error) if expected else f"its content is wrong ({type(error).__name__}: {error})"
    return untrusted(text.removeprefix(f"{path} ").removeprefix(f"{path}: "))


def _identity(path: Path) -> str:
    """Return a key that is equal for all paths to the same result."""
    try:
        return os.path.realpath(file_of(path))
    except (StoreError, OSError, ValueError):
        return os.path.abspath(path)  # noqa: PTH100 (`Path.absolute` keeps "..")


def _name(kind: str, sources: Sequence[Run | SweepFile], paths: Sequence[Path]) -> None:
    """Number sources of a kind, and name them after some paths."""
    for number, (source, label) in enumerate(zip(sources, unique_labels(paths), strict=True)):
        source.number, source.name, source.label = number, f"{kind}-{number + 1}", label


def unique_labels(paths: Sequence[Path]) -> list[str]:
    """Return unique labels: file names without suffix; folders are added if names are equal.

    Long labels are cut at the end. Labels that are equal after the cut are numbered.
    """
    parts = [(*path.absolute().parts[1:-1], path.stem) for path in paths]
    depths = [1] * len(parts)
    while True:
        labels = ["/".join(part[-depth:]) for part, depth in zip(parts, depths, strict=True)]
        counts = Counter(labels)
        clashing = [
            k for k, part in enumerate(parts) if counts[labels[k]] > 1 and depths[k] < len(part)
        ]
        if not clashing:
            break
        for k in clashing:
            depths[k] += 1
    short = [untrusted(label, MAX_LABEL_LENGTH) for label in labels]
    counts = Counter(short)
    return [
        f"{label} ({short[: k + 1].count(label)})" if counts[label] > 1 else label
        for k, label in enumerate(short)
    ]
