"""Starts commands of rbstab as forks of one process in which everything is imported.

So a command is at work a few milliseconds after its start, and a kill at a random moment meets its
work and not its imports. Its clock stands still, so that equal reports have equal bytes. Apart from
that a fork is a process like any other.

Run as a script, it reads requests from stdin, one JSON list in each line, and answers each with one
line:

    ["start", FOLDER, STDOUT, STDERR, WORD, ...]    ID of the process that runs `rbstab WORD ...`
    ["wait"]                                        exit code of that process; minus the signal
    ["mount", FOLDER, BYTES]                        0 if a file system in memory is mounted there
    ["resize", FOLDER, BYTES]                       0 if its size was changed
    ["unmount", FOLDER]                             0 if it was unmounted

The last three work in a mount namespace of its own (see `faults.full_disks`).
"""

import gc
import hashlib
import json
import os
import pickle
import signal
import subprocess
import sys
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

TIME_LIMIT = 120
"""s; a command that takes longer hangs, and is ended by SIGALRM."""

PICTURES = "RBSTAB_TEST_PICTURES"
"""The environment variable with a folder for pictures, if each is to be drawn only once."""

AT_FIRST_USE = ("h5py", "jinja2", "loky.backend", "typst", "vl_convert")
"""What libraries and the program import only where they need it."""

CLOCKS = ("rbstab.experiment.provenance", "rbstab.report.build")
"""The modules that write the time into files."""


class StoppedClock(datetime):
    """A clock on which it is always the same time."""

    @classmethod
    def now(cls, tz=None):
        """Return the time."""
        return cls(2026, 1, 1, tzinfo=tz or UTC)


def serve():
    """Answer requests; return the words of a command in its process, and None at the end."""
    running = 0
    for line in sys.stdin:
        request, *words = json.loads(line)
        if request == "start":
            running = os.fork()
            if running == 0:
                return words
            answer = running
        elif request == "wait":
            answer = os.waitstatus_to_exitcode(os.waitpid(running, 0)[1])
        else:
            answer = subprocess.run(_mount_command(request, *words), check=False).returncode
        print(answer, flush=True)  # noqa: T201 (this is a script)
    return None


def _mount_command(request, folder, size=0):
    if request == "unmount":
        return ["umount", folder]
    options = f"size={size}" if request == "mount" else f"remount,size={size}"
    return ["mount", "-t", "tmpfs", "-o", options, "rbstab-test", folder]


def run(folder, stdout, stderr, *words):
    """Run a command in this process, and end it."""
    from rbstab_cli.main import main

    files = os.devnull, stdout, stderr
    for descriptor, path in enumerate(files):
        flags = os.O_RDONLY if descriptor == 0 else os.O_WRONLY | os.O_CREAT | os.O_TRUNC
        opened = os.open(path, flags, 0o600)
        os.dup2(opened, descriptor)
        os.close(opened)
    # A worker of the command must not be ended with the tests, or the tests with the command.
    os.setsid()
    os.chdir(folder)
    signal.alarm(TIME_LIMIT)
    sys.argv = ["rbstab", *words]
    main()


def import_all():
    """Import everything that commands import, so that no fork imports it again."""
    for package in map(import_module, ("rbstab", "rbstab_cli")):
        for module in walk_packages(package.__path__, f"{package.__name__}."):
            if not module.name.endswith("__main__"):
                import_module(module.name)
    for name in AT_FIRST_USE:
        import_module(name)
    for name in CLOCKS:
        import_module(name).__dict__["datetime"] = StoppedClock
    # A collection in a fork would otherwise copy the memory of all modules.
    gc.freeze()


def remember_pictures(folder):
    """Draw each picture of reports only once, and keep it in a folder.

    Drawing takes most of the time of a report, and calls nothing that can fail.
    """
    from rbstab.report.writers import figure_files, markdown, pdf

    draw = figure_files.figure_bytes

    def figure_bytes(figure, form, *, column=False):
        kept = folder / hashlib.sha256(pickle.dumps((figure, form, column))).hexdigest()
        if not kept.exists():
            kept.write_bytes(draw(figure, form, column=column))
        return kept.read_bytes()

    for module in (figure_files, markdown, pdf):
        module.__dict__["figure_bytes"] = figure_bytes


if __name__ == "__main__":
    import_all()
    if PICTURES in os.environ:
        remember_pictures(Path(os.environ[PICTURES]))
    # Only this thread would exist in a fork.
    assert len(os.listdir("/proc/self/task")) == 1  # noqa: PTH208 (names alone)
    print("ready", flush=True)  # noqa: T201
    if (request := serve()) is not None:
        run(*request)
