"""The process of a peer, and the requests to it."""

import contextlib
import json
import os
import subprocess
import time
from pathlib import Path
from threading import Timer
from typing import Any, NamedTuple

import numpy as np

from benchmarks.peers.driver.catalogue import Peer
from benchmarks.peers.driver.environments import (
    FOLDER,
    ROOT,
    NotInstalledError,
    last_line,
    python_of,
)
from rbstab.mechanics.numbers import Array

LONGEST = 240
"""The longest wall time of one answer, s."""


class PeerError(Exception):
    """A peer failed; the text is the reason."""


class Times(NamedTuple):
    """Wall time and processor time of an integration, s."""

    wall: float
    processor: float


class PeerProcess:
    """A running peer that has the problem.

    Args:
        peer: The peer; its environment is made if it is missing.
        problem: The problem.
        home: An empty folder as its home, so that it finds no code compiled earlier.

    Raises:
        NotInstalledError: Its packages cannot be installed or imported.
    """

    def __init__(self, peer: Peer, problem: dict[str, Any], home: Path) -> None:
        command = [str(python_of(peer)), str(ROOT / "benchmarks" / "peers" / peer.script)]
        if peer.argument:
            command.append(peer.argument)
        environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        if not peer.packages:
            environment["PYTHONPATH"] = os.pathsep.join(
                map(str, (ROOT, ROOT / "src", ROOT / "cli"))
            )
        environment["HOME"] = str(home)
        FOLDER.mkdir(exist_ok=True)
        self._log = FOLDER / f"{peer.environment}-{peer.argument or 'log'}.txt"
        self._states = home / "states.npy"
        self._begin = time.perf_counter()
        with self._log.open("w") as log:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
                cwd=ROOT,
                env=environment,
            )
        try:
            self.versions: list[str] = self._ask(problem)["versions"]
        except PeerError as error:
            self.close()
            raise NotInstalledError(str(error)) from error
        self.first_result: float | None = None
        """The wall time from the start of the process to its first result, s."""

    def times(self, setting: float, members: int) -> Times:
        """Return the times to integrate the first members."""
        return Times(**self._ask({"setting": setting, "members": members, "states": None}))

    def states(self, setting: float, members: int) -> Array:
        """Return the states of the first members, shape (members, samples, 12)."""
        request = {"setting": setting, "members": members, "states": str(self._states)}
        self._ask(request)
        if self.first_result is None:
            self.first_result = time.perf_counter() - self._begin
        states: Array = np.load(self._states)
        return states

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.close()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()

    def _ask(self, request: dict[str, Any]) -> dict[str, Any]:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        timer = Timer(LONGEST, self._process.kill)
        timer.start()
        try:
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        except BrokenPipeError:
            line = ""
        finally:
            timer.cancel()
        if not line:
            raise PeerError(f"its process ended: {last_line(self._log.read_text())}")
        answer: dict[str, Any] = json.loads(line)
        if "error" in answer:
            raise PeerError(answer["error"])
        return answer
