"""Protects results against kill -9: at random moments, of every process of a command.

After each kill every file with a final name is an earlier result or a right new one. Locks are
free, no worker is left, and the same command gives the same results as if nothing had happened.
"""

import contextlib
import signal
import time

import psutil
import pytest
from faults.disturbed_commands import SWEEP, Trials, daily_and_long
from support.clusters import LocalProcesses

pytestmark = pytest.mark.skipif(
    not hasattr(signal, "SIGKILL"), reason="nothing is killed like that here"
)

KILLS = {
    "run": (3, 30),
    "run --prove": (3, 25),
    "run --force": (3, 30),
    "sweep": (2, 25),
    "sweep after its parts": (3, 30),
    "html": (1, 15),
    "md": (1, 15),
}
"""Kills of each command: in every run of the tests, and in the long one."""

SWEEP_ON_CLUSTER = tuple(word for word in SWEEP if word not in ("--threads", "3"))


@pytest.mark.parametrize(("name", "numbers"), daily_and_long(KILLS))
def test_killed_at_a_random_moment(name, numbers, undisturbed, server, tmp_path):
    trials = Trials(undisturbed(name), server, tmp_path)
    for number in numbers:
        command, rng = trials.start(number)
        trials.done.wait(command, rng, command.folder)
        workers = command.workers()
        command.send(signal.SIGKILL)
        assert command.wait().code in (-signal.SIGKILL, 0)
        _, left = psutil.wait_procs(workers, timeout=30)
        assert not left, "a worker outlives its parent"
        trials.repeat(command.folder)


@pytest.mark.parametrize(("name", "numbers"), daily_and_long({"sweep": (2, 15)}))
def test_a_killed_worker_of_a_sweep(name, numbers, undisturbed, server, tmp_path):
    """The command goes on, and its results are right."""
    trials = Trials(undisturbed(name), server, tmp_path)
    for number in numbers:
        command, rng = trials.start(number)
        command.until_workers(1)
        time.sleep(rng.uniform(0, trials.done.seconds))
        with contextlib.suppress(IndexError, psutil.NoSuchProcess):
            rng.choice(command.workers()).kill()
        trials.done.assert_done(command.folder, command.wait())
        trials.repeat(command.folder)


@pytest.mark.parametrize(("name", "numbers"), daily_and_long({"sweep": (1, 8)}))
def test_a_killed_worker_and_a_killed_scheduler(name, numbers, undisturbed, server, tmp_path):
    """Afterwards the sweep is finished without the cluster."""
    trials = Trials(undisturbed(name), server, tmp_path)
    for number in numbers:
        cluster_folder = tmp_path / f"cluster {number}"
        cluster_folder.mkdir()
        with LocalProcesses(cluster_folder) as cluster:
            killed, _ = cluster.worker(), cluster.worker()
            command, rng = trials.start(number, *SWEEP_ON_CLUSTER, "--dask", cluster.address)
            pause = rng.uniform(0, trials.done.seconds / 2)
            command.until_writing(command.folder / "results/plan/shards")
            time.sleep(pause)
            cluster.kill(killed)
            time.sleep(pause)
            assert trials.done.problems(command.folder) == []
            cluster.kill(cluster.scheduler)
            ended = command.wait()
            ended.assert_no_debris()
            assert ended.code in (0, 4), ended
            assert ended.code == 0 or "does not answer any more" in ended.stderr
        trials.repeat(command.folder)
