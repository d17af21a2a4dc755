"""Commands of rbstab that begin to work at once, to be killed or starved at random moments."""

import json
import os
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import psutil

from rbstab.store.disk.atomic import PARTIAL_SUFFIX

SERVER = Path(__file__).with_name("command_server.py")

ENVIRONMENT = {
    # A process with several threads must not fork.
    **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"),
    # The same program as here: the installed one may be another.
    "PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[1]), *sys.path]),
}
"""The variables of a process whose forks do the work."""


class Ended(NamedTuple):
    """A command that has ended: exit code, minus the signal that ended it, and what it printed."""

    code: int
    stdout: str
    stderr: str
    seconds: float

    def assert_no_debris(self):
        """Assert that nothing was printed that is not meant for users."""
        for word in ("Traceback", "Exception ignored", "HDF5", "h5py", "leaked"):
            assert word not in self.stderr, self.stderr


class Command:
    """A running command.

    Args:
        server: Has started it.
        pid: The ID of its process.
        folder: Its working folder.
    """

    def __init__(self, server, pid, folder):
        self.pid = pid
        self.folder = folder
        self.begin = time.perf_counter()
        self._server = server

    @property
    def running(self):
        """Whether the command still runs."""
        try:
            return psutil.Process(self.pid).status() != psutil.STATUS_ZOMBIE
        except psutil.NoSuchProcess:
            return False

    def workers(self):
        """Return its worker processes that serve; helpers of the library are left out."""
        processes = []
        for child in psutil.Process(self.pid).children(recursive=True):
            try:
                if "popen_loky" in " ".join(child.cmdline()):
                    processes.append(child)
            except psutil.Error:
                continue
        return processes

    def send(self, number):
        """Send a signal to the command; it may have ended."""
        # The server has not waited for it, so the ID cannot belong to another process.
        os.kill(self.pid, number)

    def until_writing(self, *folders):
        """Wait until it writes a file into one of the folders; return False if it ends before."""
        while True:
            for folder in folders:
                with suppress(FileNotFoundError):
                    names = os.listdir(folder)  # noqa: PTH208 (this must be fast)
                    if any(name.endswith(PARTIAL_SUFFIX) for name in names):
                        return True
            if not self.running:
                return False

    def until_workers(self, count):
        """Wait until it has so many workers; return False if it ends before."""
        while self.running:
            if len(self.workers()) >= count:
                return True
            time.sleep(0.01)
        return False

    def wait(self):
        """Wait until it has ended."""
        code = int(self._server.ask("wait"))
        seconds = time.perf_counter() - self.begin
        stdout, stderr = (path.read_text(encoding="utf-8") for path in self._server.output)
        return Ended(code, stdout, stderr, seconds)


class CommandServer:
    """Starts commands one after the other, as forks of a process that has imported everything.

    Args:
        folder: The folder for the output of the commands.
        prefix: The words before the command line of the server.
        environment: More environment variables.
    """

    def __init__(self, folder, prefix=(), environment=None):
        self.output = [folder / "stdout", folder / "stderr"]
        self._process = subprocess.Popen(
            [*prefix, sys.executable, str(SERVER)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | ENVIRONMENT | (environment or {}),
        )
        self.pid = self._process.pid
        if self._answer() != "ready":
            self.close()
            raise OSError(f"{' '.join(prefix)} failed")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """End the server. Commands that still run are not ended."""
        with self._process:
            self._process.kill()

    def start(self, folder, *words, stdout=None):
        """Start `rbstab` with these words in a folder."""
        files = [str(stdout or self.output[0]), str(self.output[1])]
        return Command(self, int(self.ask("start", str(folder), *files, *words)), folder)

    def run(self, folder, *words):
        """Run `rbstab` with these words in a folder until it has ended."""
        return self.start(folder, *words).wait()

    def ask(self, *request):
        """Send a request to the server, and return its answer."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return self._answer()

    def _answer(self):
        assert self._process.stdout is not None
        return self._process.stdout.readline().strip()


def wait_until(condition, seconds=30.0):
    """Wait until a condition holds; return False if it does not in this time."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.01)
    return True
