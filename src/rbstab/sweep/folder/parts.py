"""One of several processes, perhaps on different machines, that compute a sweep side by side.

Nothing is agreed between them but the plan: which shards belong to a part follows from its number.
"""

import re
from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from rbstab.store.lock import LOCK, is_locked

_LOCK_NAME = re.compile(re.escape(LOCK) + r"\.(\d+)-of-(\d+)")


class Part(NamedTuple):
    """One part of a sweep: its number, from 1, and how many parts there are."""

    number: int
    parts: int

    def __str__(self) -> str:
        """As on the command line: 3/8."""
        return f"{self.number}/{self.parts}"

    @property
    def lock(self) -> str:
        """The name of the file that the process of this part locks."""
        return f"{LOCK}.{self.number}-of-{self.parts}"

    def of(self, shards: int) -> range:
        """The numbers of the shards that belong to this part: every `parts`-th.

        Neighbours take alike long, so that all parts have as much to do, to a shard.
        """
        return range(self.number - 1, shards, self.parts)


def part_of(text: str) -> Part:
    """The part that a text names, as 3/8.

    Raises:
        ValueError: It names none.
    """
    found = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
    if found is None:
        raise ValueError(f"{text!r} is no part of a sweep (expected i/n, as 3/8)")
    part = Part(int(found[1]), int(found[2]))
    if not 1 <= part.number <= part.parts:
        raise ValueError(f"there is no part {part} (expected i/n with i from 1 to n)")
    return part


def running_parts(path: Path) -> list[Part]:
    """The parts that are being computed into a folder, as far as its file system knows locks."""
    return [part for part in _begun(path) if is_locked(path, part.lock)]


def parts_missing(path: Path, missing: Iterable[int]) -> list[Part]:
    """The parts to which missing shards belong.

    Args:
        path: The folder; in how many parts it is computed is known from the parts that were begun.
        missing: The numbers of the shards.

    Returns:
        The parts; none where no part was ever begun.
    """
    begun = Counter(part.parts for part in _begun(path))
    if not begun:
        return []
    [(parts, _)] = begun.most_common(1)
    return sorted({Part(number % parts + 1, parts) for number in missing})


def _begun(path: Path) -> list[Part]:
    found = (_LOCK_NAME.fullmatch(file.name) for file in path.glob(f"{LOCK}.*"))
    return sorted(Part(int(match[1]), int(match[2])) for match in found if match is not None)


def forget_parts(path: Path) -> None:
    """Removes the lock files of parts; the lock of the whole folder must be held."""
    for file in path.glob(f"{LOCK}.*"):
        # On Windows an open file stays, and is removed the next time.
        with suppress(OSError):
            file.unlink(missing_ok=True)
