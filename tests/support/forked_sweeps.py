"""Sweeps with a fake engine in processes of their own, which begin to work at once.

They are forks of a process that has imported everything, so a test that kills a hundred of them
does not wait for a hundred imports.
"""

import functools
import multiprocessing
import os
import sys
from multiprocessing.forkserver import ensure_running
from unittest.mock import patch

from rbstab.store.errors import StoreError
from rbstab.sweep.execution.events import ShardDone
from rbstab.sweep.folder.open_folder import parse_part
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.sweep import sweep_to_folder
from support.forked_commands import ENVIRONMENT
from support.sweeps import FakeEngine, plan_of, plan_with_traces

MEMBERS, SHARD_SIZE = 1500, 50


class ForkedSweep:
    """A process that runs a sweep of 1,500 members.

    Args:
        sweep: Runs the sweep; its last argument is the other end of `pipe`.
        arguments: The other arguments of `sweep`.
    """

    def __init__(self, sweep, *arguments):
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload([__name__])
        # Python 3.11 does not tell the process to be forked where modules are.
        with patch.dict(os.environ, ENVIRONMENT):
            ensure_running()
        self.pipe, other = context.Pipe()
        self._process = context.Process(target=sweep, args=(*arguments, other))
        self._process.start()
        other.close()

    def receive(self):
        """Return what it sends next, and None if it ends before."""
        assert self.pipe.poll(120)
        try:
            return self.pipe.recv()
        except EOFError:
            return None

    def kill(self):
        """Kill it, as the kernel does when memory is short; it may have ended."""
        self._process.kill()

    def end(self):
        """Wait until it has ended, and return its exit code."""
        self._process.join(120)
        code = self._process.exitcode
        assert code is not None
        self._process.close()
        self.pipe.close()
        return code


def sweep_whole(path, keep, delay, pipe):
    """Run the whole sweep in two threads, and send the number of each shard that is stored."""

    def on_event(event):
        if isinstance(event, ShardDone):
            pipe.send(event.number)

    factory = functools.partial(FakeEngine, delay=delay)
    options = SweepOptions(factory=factory, shard_size=SHARD_SIZE, threads=2)
    sweep_to_folder(plan_with_traces(MEMBERS, keep), path, options, on_event)


def sweep_part(path, part, delay, changes, pipe):
    """Run a part of the sweep when it is told to, and send how many of its shards are done."""
    factory = functools.partial(FakeEngine, delay=delay)
    given = {"shard_size": SHARD_SIZE, "members": MEMBERS, **changes}
    plan = plan_of(given.pop("members"))
    only = None if part == "1/1" else parse_part(part)
    pipe.send("ready")
    pipe.recv()
    try:
        done = sweep_to_folder(plan, path, SweepOptions(factory, 1, part=only, **given))
    except StoreError as error:
        pipe.send(f"{type(error).__name__}: {error}")
        sys.exit(1)
    pipe.send(len(done.inventory.done))
