"""The process of `attempts.py`, as tests see it; it is started again when it crashes or hangs."""

import json
import os
import subprocess
import sys
from queue import Empty, SimpleQueue
from threading import Thread

import psutil
from faults.hostile.attempts import Attempt
from support.forked_commands import ENVIRONMENT

PATIENCE = 90.0
"""s; after this time a command counts as hanging. The promise is 5 s on an idle machine."""


MAX_HELD = 250e6
"""Bytes. A process that holds more after an attempt is replaced: it has the libraries of all
commands so far, and what Python keeps of earlier attempts. A user reads in a fresh process."""


class Reader:
    """Reads files in another process."""

    def __init__(self):
        self._process: subprocess.Popen[str] | None = None

    def attempt(self, way, *arguments):
        """Read a file in one way."""
        process = self._process or self._start()
        requests, output = process.stdin, process.stdout
        assert requests is not None
        assert output is not None
        requests.write(json.dumps([way, *map(str, arguments)]) + "\n")
        requests.flush()
        answers: SimpleQueue[str] = SimpleQueue()
        Thread(target=lambda: answers.put(output.readline()), daemon=True).start()
        try:
            line = answers.get(timeout=PATIENCE)
        except Empty:
            self.close()
            return Attempt("hang", "", PATIENCE, 0)
        if not line:
            code = process.wait()
            self.close()
            return Attempt(f"crash {code}", "", 0.0, 0)
        if psutil.Process(process.pid).memory_info().rss > MAX_HELD:
            self.close()
        return Attempt(**json.loads(line))

    def close(self):
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def _start(self):
        self._process = subprocess.Popen(
            [sys.executable, "-m", "faults.hostile.attempts"],
            env=os.environ | ENVIRONMENT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        return self._process
