"""Protects SIGTERM, by which job systems end programs: it acts as Ctrl-C does, with its own code.

Unlike a kill, it leaves no partial file: work that was begun is finished or removed.
"""

import os
import signal
import subprocess
import sys
import time

import pytest
from cli.conftest import GOOD
from faults.contents import partial_files
from faults.disturbed_commands import Trials
from support.forked_commands import wait_until

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="no process gets SIGTERM there"),
]

TERMINATED = 143


@pytest.mark.parametrize(
    "name", ["run", "run --prove", "run --force", "sweep after its parts", "html"]
)
def test_terminated_at_a_random_moment(name, undisturbed, server, tmp_path):
    trials = Trials(undisturbed(name), server, tmp_path)
    for number in range(2):
        command, rng = trials.start(number)
        trials.done.wait(command, rng, command.folder)
        command.send(signal.SIGTERM)
        ended = command.wait()
        # The first milliseconds of a command belong to Python: a signal ends it there.
        assert ended.code in (TERMINATED, -signal.SIGTERM, 0), ended
        ended.assert_no_debris()
        assert partial_files(command.folder) == []
        trials.repeat(command.folder)


def test_all_processes_of_a_sweep_are_terminated(undisturbed, server, tmp_path):
    """The running shards are finished, also those of workers, and no others are started."""
    trials = Trials(undisturbed("sweep"), server, tmp_path)
    command, _ = trials.start(0)
    shards = command.folder / "results/plan/shards"
    assert command.until_workers(2)
    assert wait_until(lambda: any(shards.glob("0*.h5")))
    os.killpg(command.pid, signal.SIGTERM)
    ended = command.wait()
    assert ended.code == TERMINATED
    # No worker is reported as lost.
    first, second, last = ended.stderr.splitlines()
    assert first.startswith("Interrupted: ")
    assert second.startswith("Interrupted: ")
    assert last == "Run the same command again to resume."
    assert partial_files(command.folder) == []
    assert len(list(shards.glob("0*.h5"))) < 15
    trials.repeat(command.folder)


def test_terminated_twice_a_sweep_stops_at_once(undisturbed, server, tmp_path):
    trials = Trials(undisturbed("sweep"), server, tmp_path)
    command, _ = trials.start(0, *trials.done.words, "--set", "integration.time_limit=600")
    shards = command.folder / "results/plan/shards"
    assert wait_until(lambda: any(shards.glob("0*.h5")))
    command.send(signal.SIGTERM)
    time.sleep(0.02)
    command.send(signal.SIGTERM)
    ended = command.wait()
    assert ended.code == TERMINATED
    assert "Run the same command again to resume." in ended.stderr
    assert "Traceback" not in ended.stderr


def test_a_terminated_run_says_what_is_stored(server, tmp_path):
    (tmp_path / "good.yaml").write_text(GOOD)
    endless = GOOD.replace("duration: 0.1, samples: 11", "duration: 1e6, samples: 2")
    (tmp_path / "endless.yaml").write_text(endless)
    command = server.start(tmp_path, "run", "--no-prove", "good.yaml", "endless.yaml")
    assert wait_until((tmp_path / "results/good.h5").exists)
    # A file has its name a moment before its run is counted.
    time.sleep(0.3)
    command.send(signal.SIGTERM)
    ended = command.wait()
    assert ended.code == TERMINATED
    assert "Interrupted: 1 of 2 runs are stored." in ended.stderr
    assert [path.name for path in (tmp_path / "results").iterdir()] == ["good.h5"]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_in_a_destructor_is_not_lost(number):
    """Python drops an exception in a destructor, and goes on."""
    code = (
        "import os, signal, sys, time\n"
        "from rbstab_cli import main\n"
        # Shells start commands in the background with SIGINT ignored.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "class Dropped:\n"
        "    def __del__(self):\n"
        "        os.kill(os.getpid(), int(sys.argv[1]))\n"
        "        time.sleep(0.01)\n"
        "def run(**_):\n"
        "    Dropped()\n"
        "    time.sleep(60)\n"
        "main.cli.main = run\n"
        "main.main()\n"
    )
    words = [sys.executable, "-c", code, str(int(number))]
    done = subprocess.run(words, check=False, capture_output=True, text=True, timeout=50)
    assert done.returncode == 128 + number
    assert done.stderr == "Interrupted.\n"


def test_sigterm_that_the_caller_ignores_stays_ignored():
    code = (
        "import os, signal, sys\n"
        "from rbstab_cli import main\n"
        "signal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
        "main._exit_code = lambda: os.kill(os.getpid(), signal.SIGTERM) or 0\n"
        "main.main()\n"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
    heeded = code.replace("SIG_IGN", "SIG_DFL")
    done = subprocess.run([sys.executable, "-c", heeded], check=False, capture_output=True)
    assert done.returncode != 0
