"""A Dask scheduler and its workers, as real processes on this machine that tests may kill."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from support.sweeps import FakeEngine

ON_A_WORKER = "RBSTAB_TEST_WORKER"
"""An environment variable that only workers have."""

TESTS = Path(__file__).parents[1]


class DeadlyEngine(FakeEngine):
    """An engine that kills its worker at member 7."""

    def compute(self, start, stop):
        if start <= 7 < stop and ON_A_WORKER in os.environ:
            os.kill(os.getpid(), signal.SIGKILL)
        return super().compute(start, stop)


class LocalProcesses:
    """A scheduler and workers of one thread each; the operating system chooses the ports.

    Args:
        folder: The folder of their logs and temporary files.
        environment: More environment variables for them.
    """

    def __init__(self, folder, environment=None):
        self.folder = folder
        path = os.pathsep.join([str(TESTS), os.environ.get("PYTHONPATH", "")])
        self.environment = {**os.environ, "PYTHONPATH": path, ON_A_WORKER: "1"}
        self.environment |= environment or {}
        self.processes: list[subprocess.Popen[bytes]] = []
        self.file = folder / "scheduler.json"
        options = ("--no-dashboard", "--port", "0", "--scheduler-file", str(self.file))
        self.scheduler = self._start("scheduler", "--host", "127.0.0.1", *options)
        self.address = self._address()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process in reversed(self.processes):
            process.kill()
            process.wait()

    def worker(self, *options):
        """Start a worker without a nanny, which would replace a killed worker."""
        fixed = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--host", "127.0.0.1")
        local = ("--local-directory", str(self.folder))
        return self._start("worker", self.address, *fixed, *local, *options)

    def kill(self, process):
        """Kill one of the processes, as the kernel does when memory is short."""
        process.send_signal(signal.SIGKILL)
        process.wait()

    def _start(self, *arguments):
        log = (self.folder / f"{len(self.processes)}.log").open("wb")
        with log:
            process = subprocess.Popen(
                [sys.executable, "-m", "dask", *arguments],
                stdout=log,
                stderr=log,
                env=self.environment,
            )
        self.processes.append(process)
        return process

    def _address(self):
        """Wait for the scheduler and return its address."""
        while True:
            assert self.scheduler.poll() is None, (self.folder / "0.log").read_text()
            if self.file.exists():
                try:
                    return str(json.loads(self.file.read_text())["address"])
                except ValueError:
                    pass  # The file is half written.
            time.sleep(0.02)
