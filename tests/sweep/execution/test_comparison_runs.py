"""Protects the runs for a comparison: the same in any process, even if a process dies."""

import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, cast

import psutil
import pytest
from support.paper_runs import paper_config

from rbstab.sweep.execution import compare_with_scipy, comparison_runs
from rbstab.sweep.execution.comparison_runs import (
    MEMBERS_PER_WORKER,
    MEMBERS_WHILE_IMPORTING,
    ComparisonRuns,
)
from rbstab.sweep.execution.comparison_worker import start_comparison_worker
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.load import load_plan

if TYPE_CHECKING:
    from rbstab.processes.workers import Worker
    from rbstab.sweep.folder.sweep_folder import SweepFolder

pytestmark = pytest.mark.slow

MEMBERS = list(range(3, 3 + 4 * MEMBERS_PER_WORKER, 2))
"""Enough for two workers."""


def plan(members=100, engine="scipy"):
    """Return a plan of short members."""
    return load_plan(
        {
            "base": paper_config("permanent", duration=0.1, samples=3, rtol=1e-6, engine=engine),
            "vary": {"initial.angular_velocity[0]": {"uniform": [-20, 20]}},
            "design": "random",
            "members": members,
            "seed": 3,
        }
    )


def bits(found):
    return {
        member: {name: column.tobytes() for name, column in outcome.items()}
        for member, outcome in found.items()
    }


def expected():
    singles = SingleRuns(plan(), "scipy", with_largest=True)
    return bits({member: singles.compute(member, member + 1).outcome for member in MEMBERS})


def workers_of(process, before=()):
    children = process.children(recursive=True)
    return [
        child
        for child in children
        if child.pid not in before and "popen_loky" in " ".join(child.cmdline())
    ]


def children_here():
    return {child.pid for child in psutil.Process().children(recursive=True)}


def wait_for(condition):
    """Wait until a condition holds, for at most a minute."""
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_workers_find_what_this_process_finds():
    """The workers do all of it: nothing calls `finish` before."""
    counts: list[int] = []
    with ComparisonRuns(plan(), MEMBERS, 2) as runs:
        wait_for(lambda: len(runs.outcomes) == len(MEMBERS))
        found = runs.finish(Event(), counts.append)
    assert found is not None
    assert bits(found) == expected()
    assert counts == [len(MEMBERS)]


def test_what_is_left_is_run_here_meanwhile():
    counts: list[int] = []
    with ComparisonRuns(plan(), MEMBERS, 2) as runs:
        found = runs.finish(Event(), counts.append)
    assert found is not None
    assert bits(found) == expected()
    assert counts[0] < counts[-1] == len(MEMBERS)
    assert counts == sorted(set(counts))


def test_a_worker_that_was_started_before_runs_the_members(monkeypatch):
    before = children_here()
    with closing(start_comparison_worker()) as worker:
        monkeypatch.setattr(comparison_runs, "start_comparison_worker", None)
        with ComparisonRuns(plan(), MEMBERS[:4], 1, worker) as runs:
            wait_for(lambda: len(runs.outcomes) == 4)
            found = runs.finish(Event(), lambda _: None)
    assert found is not None
    assert bits(found) == {member: expected()[member] for member in MEMBERS[:4]}
    assert not workers_of(psutil.Process(), before)


def test_a_started_worker_that_died_is_not_missed():
    before = children_here()
    with closing(start_comparison_worker()) as worker:
        wait_for(lambda: workers_of(psutil.Process(), before))
        for started in workers_of(psutil.Process(), before):
            started.kill()
        with ComparisonRuns(plan(), MEMBERS[:4], 1, worker) as runs:
            found = runs.finish(Event(), lambda _: None)
    assert found is not None
    assert sorted(found) == MEMBERS[:4]


def test_this_process_imports_scipy_only_to_run_many_members(monkeypatch):
    """The few that are left are run by a worker sooner."""
    here: list[int] = []

    class Here(SingleRuns):
        def compute(self, start, stop):
            here.append(start)
            return super().compute(start, stop)

    monkeypatch.setattr(comparison_runs, "SingleRuns", Here)
    few, many = MEMBERS[:MEMBERS_WHILE_IMPORTING], MEMBERS
    with ComparisonRuns(plan(), few, 1) as runs:
        runs.finish(Event(), lambda _: None)
    assert not here
    with ComparisonRuns(plan(), many, 1) as runs:
        runs.finish(Event(), lambda _: None)
    assert 0 < len(here) < len(many)


def test_the_work_of_a_process_that_dies_is_done_here():
    before = children_here()
    with ComparisonRuns(plan(), MEMBERS, 2) as runs:
        wait_for(lambda: runs.outcomes)
        for worker in workers_of(psutil.Process(), before):
            worker.kill()
        found = runs.finish(Event(), lambda _: None)
    assert found is not None
    assert bits(found) == expected()


def test_an_unexpected_error_of_a_worker_loses_no_member(monkeypatch):
    class Broken:
        def __init__(self, *_):
            self.answers = 0

        def has_answer(self, _):
            return True

        def receive(self):
            self.answers += 1
            if self.answers == 2:
                raise MemoryError
            return {"run_id": None}

        def send(self, _):
            pass

        def close(self):
            pass

    monkeypatch.setattr(comparison_runs, "start_comparison_worker", Broken)
    with ComparisonRuns(plan(), MEMBERS[:5], 1) as runs:
        found = runs.finish(Event(), lambda _: None)
    assert found is not None
    assert sorted(found) == MEMBERS[:5]


def test_without_workers_all_is_run_here():
    before = children_here()
    with ComparisonRuns(plan(), MEMBERS[:3], 0) as runs:
        found = runs.finish(Event(), lambda _: None)
        assert children_here() == before
    assert found is not None
    assert list(found) == MEMBERS[:3]


def test_nothing_goes_on_when_nobody_waits_for_it():
    before = children_here()
    with ComparisonRuns(plan(), MEMBERS, 2):
        wait_for(lambda: workers_of(psutil.Process(), before))
    assert not workers_of(psutil.Process(), before)


def test_a_stop_ends_the_runs():
    stop = Event()
    with ComparisonRuns(plan(), MEMBERS, 0) as runs:
        found = runs.finish(stop, lambda done: stop.set() if done == 2 else None)
        assert found is None
        assert len(runs.outcomes) < len(MEMBERS)


@pytest.mark.parametrize(
    ("members", "processes", "is_started", "expected"),
    [
        (100, 2, False, 0),
        (100, 2, True, 1),
        (100, 1, True, 0),
        (600, 1, False, 0),
        (600, 2, False, 1),
        (600, 4, False, 1),
    ],
)
def test_only_long_plans_start_a_worker(members, processes, is_started, expected, monkeypatch):
    started: list[int] = []

    class Runs(ComparisonRuns):
        def __init__(self, given, chosen, workers, _):
            started.append(min(workers, 1))
            super().__init__(given, chosen, 0)

    monkeypatch.setattr(compare_with_scipy, "ComparisonRuns", Runs)
    unread = cast("SweepFolder", None)  # An incomplete folder is not read.
    compare_with_scipy.comparison_runs(
        plan(members, "heyoka"),
        unread,
        None,
        complete=False,
        processes=processes,
        started=cast("Worker", object()) if is_started else None,
    )
    assert started == [expected]


COMPARER = """
from threading import Event
from test_comparison_runs import MEMBERS, plan
from rbstab.sweep.execution import compare_with_scipy
from rbstab.sweep.execution.comparison_runs import ComparisonRuns
with ComparisonRuns(plan(), MEMBERS * 50, 2) as runs:
    while not runs.outcomes:
        pass
    print("running", flush=True)
    runs.finish(Event(), lambda _: None)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="nothing is killed like that here")
def test_no_process_outlives_its_parent():
    here, tests = Path(__file__).parent, Path(__file__).parents[2]
    path = os.pathsep.join([str(here), str(tests), os.environ.get("PYTHONPATH", "")])
    with subprocess.Popen(
        [sys.executable, "-c", COMPARER],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": path},
    ) as parent:
        assert parent.stdout is not None
        parent.stdout.readline()
        others = workers_of(psutil.Process(parent.pid))
        assert others
        parent.kill()
    _, left = psutil.wait_procs(others, timeout=5)
    assert not left
