"""A process that reads hostile files in all ways a user can, and measures time and memory.

It reads requests from stdin, one JSON list [WAY, PATH, ...] in each line, and answers each with a
line: a JSON object with the keys of `Attempt`.
"""

import json
import os
import sys
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import psutil
from click.testing import CliRunner

import rbstab
from rbstab.experiment.proof_cache import cached_proof
from rbstab.experiment.stored_run import stored_config
from rbstab.report.reading.sources import read_sources
from rbstab.sweep.folder.shard_inventory import shard_inventory
from rbstab.sweep.folder.sweep_folder import read_folder
from rbstab_cli.main import cli

MAX_TEXT = 1 << 20
"""The most characters of a text in an answer: its end."""


class Attempt(NamedTuple):
    """One way to read one file.

    Args:
        outcome: "read", or the class of the error of the store, or "exit CODE" of a command. Any
            other error is its traceback.
        text: A digest of what was read, the message of the error, or what the command printed.
        seconds: The time it took.
        memory: The largest memory of this process or one of its workers, bytes; 0 if unknown.
    """

    outcome: str
    text: str
    seconds: float
    memory: int


def run(path):
    return content_of(rbstab.open_result(path))


def content_of(result):
    """Return all numbers and texts of a result."""
    arrays = {name: (v.data.tolist(), *v[2:]) for name, v in result.variables.items()}
    return repr((result.attributes, result.config, arrays))


def sweep(path):
    table = rbstab.open_sweep(path)
    return repr({name: table[name].tobytes() for name in table.columns})


def traces(path):
    return repr([motions["lyapunov"].tobytes() for motions in rbstab.open_traces(path)])


def sources(path):
    """Read a file for a report, and return what it lists; it is never unlisted."""
    listing = read_sources([path])
    assert len(listing.runs) + len(listing.sweeps) + len(listing.unread) == 1
    return repr(
        [*(content_of(stored.result) for stored in listing.runs), *listing.sweeps, *listing.unread]
    )


def inventory(path):
    """Read the shards of a folder."""
    shards = shard_inventory(read_folder(path), read_traces=True)
    return repr(sorted((number, facts.digest) for number, facts in shards.done.items()))


def proof(path):
    """Read the proof beside a run."""
    config = stored_config(rbstab.open_result(path)).config
    assert config is not None
    return repr(cached_proof(path.parent, config))


def allocate(path):
    """Take some memory; shows that memory is measured."""
    return str(len(bytearray(int(path.name))))


READERS: dict[str, Callable[[Path], str]] = {
    reader.__name__: reader for reader in (run, sweep, traces, sources, inventory, proof, allocate)
}


def attempt(way, arguments):
    """Return outcome and text."""
    if way not in READERS:
        return command(way, arguments)
    try:
        return "read", READERS[way](Path(arguments[0]))
    except rbstab.StoreError as error:
        return type(error).__name__, str(error)
    except Exception:
        return traceback.format_exc(), ""


def command(name, arguments):
    # The readers have the names of some commands.
    name = name.removesuffix("_command")
    done = CliRunner().invoke(cli, [name, *arguments])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        return "".join(traceback.format_exception(done.exception)), ""
    return f"exit {done.exit_code}", done.output


def processes():
    return [os.getpid(), *(child.pid for child in psutil.Process().children(recursive=True))]


def forget_peaks():
    """Let the system measure the largest memory of these processes anew."""
    for number in processes():
        # A worker that is just ending has no memory any more.
        with suppress(FileNotFoundError, ProcessLookupError):
            Path(f"/proc/{number}/clear_refs").write_text("5", encoding="ascii")


def peak():
    return max(map(peak_of, processes()))


def peak_of(number):
    try:
        lines = Path(f"/proc/{number}/status").read_text(encoding="utf-8").splitlines()
    except (FileNotFoundError, ProcessLookupError):
        # A worker that has just ended.
        return 0
    values = [int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM")]
    return values[0] if values else 0


def serve():
    measurable = os.access("/proc/self/clear_refs", os.W_OK)
    for line in sys.stdin:
        way, *arguments = json.loads(line)
        if measurable:
            forget_peaks()
        start = time.monotonic()
        outcome, text = attempt(way, arguments)
        seconds = time.monotonic() - start
        answer: dict[str, Any] = Attempt(
            outcome, text[-MAX_TEXT:], seconds, peak() if measurable else 0
        )._asdict()
        sys.__stdout__.write(json.dumps(answer) + "\n")  # type: ignore[union-attr]
        sys.__stdout__.flush()  # type: ignore[union-attr]


if __name__ == "__main__":
    serve()
