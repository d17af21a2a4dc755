"""Protects single runs in several processes: the same results as in one, even if a process dies."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import psutil
import pytest
from support.paper_runs import paper_config

from rbstab.sweep.execution.single_run_pool import MIN_FOR_PROCESSES, run_singles
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.load import load_plan

pytestmark = pytest.mark.slow

MEMBERS = list(range(3, 3 + 2 * MIN_FOR_PROCESSES, 2))


def plan():
    """Return a plan of short members."""
    return load_plan(
        {
            "base": paper_config("permanent", duration=0.1, samples=3, rtol=1e-6),
            "vary": {"initial.angular_velocity[0]": {"uniform": [-20, 20]}},
            "design": "random",
            "members": 100,
            "seed": 3,
        }
    )


def bits(found):
    return {
        member: {name: column.tobytes() for name, column in outcome.items()}
        for member, outcome in found.items()
    }


def expected():
    singles = SingleRuns(plan(), "scipy")
    return bits({member: singles.compute(member, member + 1).outcome for member in MEMBERS})


def test_several_processes_find_what_one_finds():
    found = dict(filter(None, run_singles(plan(), "scipy", MEMBERS, 2)))
    assert bits(found) == expected()
    assert len({outcome["run_id"].tobytes() for outcome in found.values()}) == len(MEMBERS)


def test_the_work_of_a_process_that_dies_is_done_here():
    found: dict[int, dict[str, np.ndarray]] = {}
    before = {child.pid for child in psutil.Process().children(recursive=True)}
    results = run_singles(plan(), "scipy", MEMBERS, 2)
    for one in filter(None, results):
        if not found:
            others = [
                child
                for child in psutil.Process().children(recursive=True)
                if child.pid not in before and "popen_loky" in " ".join(child.cmdline())
            ]
            assert others
            others[0].kill()
        assert one[0] not in found
        found[one[0]] = one[1]
    assert bits(found) == expected()


def test_few_members_are_followed_here():
    before = len(psutil.Process().children(recursive=True))
    results = run_singles(plan(), "scipy", MEMBERS[:3], 2)
    first = next(results)
    assert first is not None
    assert first[0] == MEMBERS[0]
    assert len(psutil.Process().children(recursive=True)) == before
    others = list(results)
    assert None not in others
    assert [one[0] for one in others if one is not None] == MEMBERS[1:3]


def test_nothing_goes_on_when_nobody_waits_for_it():
    before = {child.pid for child in psutil.Process().children(recursive=True)}
    results = run_singles(plan(), "scipy", MEMBERS, 2)
    next(one for one in results if one)
    results.close()
    left = [
        child
        for child in psutil.Process().children(recursive=True)
        if child.pid not in before and "popen_loky" in " ".join(child.cmdline())
    ]
    assert not left


COMPARER = """
from test_single_run_pool import MEMBERS, plan
from rbstab.sweep.execution.single_run_pool import run_singles
for one in run_singles(plan(), "scipy", MEMBERS * 50, 2):
    print(one, flush=True)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="nothing is killed like that here")
def test_no_process_outlives_its_parent():
    here, tests = Path(__file__).parent, Path(__file__).parents[2]
    with subprocess.Popen(
        [sys.executable, "-c", COMPARER],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": f"{here}{os.pathsep}{tests}"},
    ) as parent:
        assert parent.stdout is not None
        parent.stdout.readline()
        children = psutil.Process(parent.pid).children(recursive=True)
        others = [child for child in children if "popen_loky" in " ".join(child.cmdline())]
        assert len(others) == 2
        parent.kill()
    _, left = psutil.wait_procs(others, timeout=5)
    assert not left
