"""Run commands in forks of a process that has imported everything."""

import atexit
import gc
import hashlib
import importlib
import json
import os
import pickle
import pkgutil
import shlex
import signal
import sys
import threading
import time
import traceback
from pathlib import Path
from typing import NamedTuple

from faults.library.contents import Content, content_of
from support.command_server import CLOCKS, StoppedClock

from rbstab.report.model.figure import Figure

TIME_LIMIT = 120.0
"""s; a command that takes longer hangs."""


class RunHere(BaseException):
    """Raised in a forked process: leave everything, and run this command."""

    def __init__(self, arguments: list[str]) -> None:
        self.arguments = arguments


class Ended(NamedTuple):
    """How a command ended: its exit code (negative: a signal) and its output."""

    code: int
    stdout: str
    stderr: str


def run(arguments, folder):
    """Run a command in a fork of this process, in a working folder."""
    output = [folder / name for name in ("stdout", "stderr")]
    child = os.fork()
    if not child:
        os.setsid()
        os.chdir(folder)
        for number, path in enumerate([Path(os.devnull), *output]):
            file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_TRUNC)
            os.dup2(file, number)
            os.close(file)
        raise RunHere(shlex.split(arguments))
    code = wait(child)
    return Ended(code, *(path.read_text(errors="replace") for path in output))


def wait(child):
    """Wait for a process; kill it if it hangs. Return its exit code."""
    end = time.monotonic() + TIME_LIMIT
    pause = 0.001
    while True:
        found, status = os.waitpid(child, os.WNOHANG)
        if found:
            return os.waitstatus_to_exitcode(status)
        if time.monotonic() > end:
            os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return -signal.SIGALRM
        time.sleep(pause)
        pause = min(0.02, pause * 1.5)


def read_contents(folder, names):
    """Return the contents of files, read in a fork, because HDF5 may crash on a wrong file."""
    reader, writer = os.pipe()
    child = os.fork()
    if not child:
        os.close(reader)
        with os.fdopen(writer, "w") as answer:
            json.dump([content_of(folder / name) for name in names], answer)
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader) as answer:
        text = answer.read()
    code = wait(child)
    if code != 0:
        return [{"unreadable": f"reading ended with {code}"} for _ in names]
    contents: list[Content] = json.loads(text)
    return contents


def run_to_end(arguments):
    """Run the command, and end this process as the interpreter does, but without its teardown.

    The teardown frees all modules, which takes ten times as long as most commands.
    """
    from rbstab_cli.main import main as rbstab

    sys.argv = ["rbstab", *arguments]
    code: object = 0
    try:
        rbstab()
    except SystemExit as error:
        code = error.code
    except BaseException:
        traceback.print_exc()
        code = 1
    threading._shutdown()  # type: ignore[attr-defined]
    atexit._run_exitfuncs()
    # Unclosed files are closed here; an error of that is printed to stderr.
    gc.collect()
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            code = 120
    os._exit(code if isinstance(code, int) else 1)


def import_all():
    """Import everything that commands import, so that no fork imports it again."""
    for package in map(importlib.import_module, ("rbstab", "rbstab_cli")):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not module.name.endswith("__main__"):
                importlib.import_module(module.name)
    for name in CLOCKS:
        importlib.import_module(name).__dict__["datetime"] = StoppedClock
    # Imported by the libraries at their first use.
    for name in ("h5py", "jinja2", "loky.backend", "typst", "vl_convert"):
        importlib.import_module(name)
    threads = len(os.listdir("/proc/self/task"))  # noqa: PTH208 (names alone)
    assert threads == 1, f"{threads} threads: a fork would be unsafe"
    # A collection in a fork would otherwise copy the memory of all modules.
    gc.freeze()


def remember_pictures(folder):
    """Draw each picture of reports only once, and keep it in a folder.

    Drawing takes most of the time of a report, and calls nothing that can fail.
    """
    from rbstab.report.writers import figure_files, markdown, pdf

    draw = figure_files.figure_bytes

    def figure_bytes(figure: Figure, form: str, *, column: bool = False) -> bytes:
        kept = folder / hashlib.sha256(pickle.dumps((figure, form, column))).hexdigest()
        if not kept.exists():
            kept.write_bytes(draw(figure, form, column=column))
        return kept.read_bytes()

    for module in (figure_files, markdown, pdf):
        module.__dict__["figure_bytes"] = figure_bytes
