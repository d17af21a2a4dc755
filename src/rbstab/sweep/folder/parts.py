"""Parts of a sweep: several processes, possibly on different machines, that share a sweep.

The processes share the plan and the folder, and do not communicate. The number of a part defines
its shards.
"""

import re
from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from rbstab.store.disk.lock import LOCK_FILE, is_locked

_LOCK_NAME = re.compile(re.escape(LOCK_FILE) + r"\.(\d+)-of-(\d+)")


class Part(NamedTuple):
    """A part of a sweep.

    Args:
        number: From 1.
        parts: The number of parts of the sweep.
    """

    number: int
    parts: int

    def __str__(self) -> str:
        """Return the part as on the command line: 3/8."""
        return f"{self.number}/{self.parts}"

    @property
    def lock(self) -> str:
        """The name of the lock file of this part."""
        return f"{LOCK_FILE}.{self.number}-of-{self.parts}"

    def shard_numbers(self, shards: int) -> range:
        """Return the numbers of this part's shards: every `parts`-th shard of the sweep.

        Neighbouring shards take about the same time, so all parts get about the same work.

        Args:
            shards: The number of shards of the sweep.
        """
        return range(self.number - 1, shards, self.parts)


def parse_part(text: str) -> Part:
    """Parse a part such as 3/8.

    Raises:
        ValueError: The text is not a part.
    """
    found = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
    if found is None:
        raise ValueError(f"{text!r} is not a part of a sweep (expected i/n, such as 3/8)")
    part = Part(int(found[1]), int(found[2]))
    if not 1 <= part.number <= part.parts:
        raise ValueError(f"{part} is not a part of a sweep (expected i/n with i from 1 to n)")
    return part


def running_parts(path: Path) -> list[Part]:
    """Return the parts that are running in a folder. The file system must support locks."""
    return [part for part in _started_parts(path) if is_locked(path, part.lock)]


def parts_with_missing(path: Path, missing: Iterable[int]) -> list[Part]:
    """Return the parts to which missing shards belong.

    The number of parts is taken from the parts that were started in the folder.

    Args:
        path: The folder.
        missing: The numbers of the missing shards.

    Returns:
        The parts, ascending; empty if no part was ever started.
    """
    counts = Counter(part.parts for part in _started_parts(path))
    if not counts:
        return []
    [(parts, _)] = counts.most_common(1)
    return sorted({Part(number % parts + 1, parts) for number in missing})


def _started_parts(path: Path) -> list[Part]:
    found = (_LOCK_NAME.fullmatch(file.name) for file in path.glob(f"{LOCK_FILE}.*"))
    return sorted(Part(int(match[1]), int(match[2])) for match in found if match is not None)


def remove_part_locks(path: Path) -> None:
    """Remove the lock files of parts; the caller must hold the lock of the whole folder."""
    for file in path.glob(f"{LOCK_FILE}.*"):
        # Windows cannot remove an open file; a later call removes it.
        with suppress(OSError):
            file.unlink(missing_ok=True)
