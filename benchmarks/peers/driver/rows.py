"""Choose the setting of each peer, and time all peers in turns."""

import math
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.measure import by_turns
from benchmarks.peers.driver.catalogue import PEERS, Peer
from benchmarks.peers.driver.environments import NotInstalledError
from benchmarks.peers.driver.problem import largest_error, problem_of_members, reference_of
from benchmarks.peers.driver.process import PeerError, PeerProcess, Times
from rbstab.mechanics.numbers import Array

TARGETS = (1e-6, 1e-8)
"""The largest errors that are allowed, one column each."""

MEMBERS = 16_384
CHECKED = 16
"""Members whose error is measured."""

GLANCE = 2
"""Members that are tried first; if their error is too large, the others are not tried."""

TIMED_SECONDS, FEWEST, ROUNDS = 1.0, 2, 3
"""Each timing takes about a second, but has at least these members; the median of the rounds."""

BUSY = 0.9
"""Below this share of processor time in wall time, a warning is printed."""


@dataclass
class Measured:
    """A peer at one target.

    Attributes:
        setting: The loosest setting within the target; None: the target was not reached.
        error: The error at this setting, or else the smallest error of all settings.
        members: How many members were timed.
        times: The times of each round.
        rate: Members per second, from the median wall time; NaN: a timing failed.
    """

    setting: float | None
    error: float
    members: int = 0
    times: list[Times] = field(default_factory=list)
    rate: float = 0.0


class Row(NamedTuple):
    """A peer with its results.

    Attributes:
        peer: The peer.
        versions: The versions of its packages.
        first_result: Wall time until its first result, s.
        measured: Its results, one for each target; empty: it could not run.
        failure: Why it could not run.
    """

    peer: Peer
    versions: list[str]
    first_result: float
    measured: list[Measured]
    failure: str = ""


def measured_rows() -> list[Row]:
    """Install, check and time all peers. A peer that fails does not stop the others."""
    problem, reference = problem_of_members(MEMBERS), reference_of(CHECKED)
    with ExitStack() as stack:
        rows, processes = [], []
        for peer in PEERS:
            try:
                process = _started(peer, problem, stack)
                measurements = list(_settings(process, peer, reference))
                rows.append(Row(peer, process.versions, process.first_result or 0.0, measurements))
                processes.append((process, measurements))
            except NotInstalledError as error:
                rows.append(Row(peer, [], 0.0, [], f"not installed: {error}"))
            except PeerError as error:
                rows.append(Row(peer, [], 0.0, [], f"failed: {error}"))
            print(_line(rows[-1]), flush=True)
        _time(
            [
                (process, measured)
                for process, measurements in processes
                for measured in measurements
                if measured.members
            ]
        )
    return rows


def _started(peer: Peer, problem: dict[str, Any], stack: ExitStack) -> PeerProcess:
    home = Path(stack.enter_context(tempfile.TemporaryDirectory()))
    process = PeerProcess(peer, problem, home)
    stack.callback(process.close)
    return process


def _settings(process: PeerProcess, peer: Peer, reference: Array) -> Iterator[Measured]:
    """Yield the loosest setting for each target, with the number of members to time."""
    smallest = float("inf")
    ladder = iter(peer.ladder)
    setting, error = None, float("inf")
    for target in TARGETS:
        while error > target and (setting := next(ladder, None)) is not None:
            error = largest_error(process.states(setting, GLANCE), reference)
            if error <= target:
                error = largest_error(process.states(setting, CHECKED), reference)
            smallest = min(smallest, error)
        if setting is None:
            yield Measured(None, smallest)
        else:
            yield Measured(setting, error, _timed_members(process, peer, setting))


def _timed_members(process: PeerProcess, peer: Peer, setting: float) -> int:
    """Return a number of members that takes about a second, or else the largest batch."""
    members = FEWEST
    while members < peer.largest_batch:
        seconds = process.times(setting, members).wall
        if 2 * seconds > TIMED_SECONDS:
            break
        # A short time is mostly a fixed cost, so it says little about larger numbers.
        members *= min(16, 2 ** int(math.log2(TIMED_SECONDS / seconds)))
    return min(members, peer.largest_batch)


def _time(pairs: list[tuple[PeerProcess, Measured]]) -> None:
    """Time all pairs in turns, so that a drifting machine speed affects all alike."""

    def seconds(process: PeerProcess, measured: Measured) -> float:
        assert measured.setting is not None
        try:
            times = process.times(measured.setting, measured.members)
        except PeerError as error:
            print(f"a timing failed: {error}", flush=True)
            return math.nan
        measured.times.append(times)
        return times.wall / measured.members

    actions = [lambda pair=pair: seconds(*pair) for pair in pairs]
    for (_, measured), taken in zip(pairs, by_turns(ROUNDS, *actions), strict=True):
        measured.rate = 1 / taken
        walls = sum(times.wall for times in measured.times)
        share = sum(times.processor for times in measured.times) / walls if walls else 0.0
        if share < BUSY:
            print(f"WARNING: a process had only {share:.0%} of its core; the machine is busy")


def _line(row: Row) -> str:
    """Return the progress of one peer as text."""
    settings = ", ".join(
        f"{measured.setting} (error {measured.error:.1e})" for measured in row.measured
    )
    return f"{row.peer.title}: {row.failure or settings}"
