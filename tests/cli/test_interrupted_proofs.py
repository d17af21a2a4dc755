"""Protects interrupts of the proofs after a run or a sweep: results stay, and gaps are named."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from cli.conftest import GOOD
from support.printed_paths import printed

from rbstab import open_result
from rbstab.sweep.folder.sweep_table import read_sweep

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="SIGINT cannot be sent to one process"
)

CODES = {signal.SIGINT: 130, signal.SIGTERM: 143}

BODIES = "base: good.yaml\nvary: {body.mass: {linspace: [40, 44, 5]}}\n"
SHARED = "base: good.yaml\nvary:\n  initial.angular_velocity[1]: {values: [1, 2]}\n"

PROGRAM = """
import os, sys
from importlib import import_module
from rbstab_cli.main import main

module, function, count, number = sys.argv[1:5]
sys.argv[1:5] = []
module = import_module(module)
calls, original = [], getattr(module, function)

def interrupted(*arguments, **options):
    calls.append(arguments)
    if len(calls) == int(count):
        os.kill(os.getpid(), int(number))
    return original(*arguments, **options)

setattr(module, function, interrupted)
import rbstab.processes.processors as processors
processors.processor_count = lambda: 1
main()
"""
"""Runs the command line in one process, which interrupts itself at a call of a function."""


def interrupted(function: str, count: int, number: int, *arguments: str) -> tuple[int, str, str]:
    """Run a command that gets a signal as it calls a function for the `count`-th time."""

    def restore_interrupts() -> None:
        # A shell makes its background processes and their children ignore interrupts.
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    module, _, name = function.rpartition(".")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, module, name, str(count), str(int(number)), *arguments],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=restore_interrupts,
    )
    assert "Traceback" not in done.stderr
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("number", CODES)
def test_proofs_of_runs(folder: Path, number: int) -> None:
    Path("other.yaml").write_text(GOOD.replace("mass: 41", "mass: 42"))
    code, stdout, stderr = interrupted(
        *("rbstab.experiment.run_to_file.prove_run", 2, number),
        *("run", "good.yaml", "other.yaml"),
    )
    assert code == CODES[signal.Signals(number)]
    lost = printed("the proofs of results/other.h5 are missing")
    assert f"Interrupted: 2 of 2 runs are stored; {lost}.\n" in stderr
    assert stderr.endswith("Run the same command again to resume.\n")
    assert open_result("results/good.h5").attributes["convergence"] == "proved"
    assert open_result("results/other.h5").status == "completed"
    assert printed("results/good.h5") in stdout
    assert "This start:" in stdout


@pytest.mark.parametrize("number", CODES)
def test_proofs_of_bodies(folder: Path, number: int) -> None:
    """The proof that is running is finished and stored; the first two are 40 and 43 kg."""
    Path("bodies.yaml").write_text(BODIES)
    words = ("sweep", "bodies.yaml", "--threads", "1")
    prove = "rbstab.sweep.proofs.prove_bodies._prove"
    code, stdout, stderr = interrupted(prove, 2, number, *words)
    assert code == CODES[signal.Signals(number)]
    stored = "all 5 members are stored in results/bodies/members.h5"
    lost = "the proofs of 3 of 5 distinct bodies: those of members 1 to 2, 4"
    assert f"Interrupted: {stored}; missing: {lost}.\n" in stderr
    assert stderr.endswith("Run the same command again to resume.\n")
    assert "Convergence: proved for 2 of the members" in stdout
    table = read_sweep(Path("results/bodies/members.h5"))
    known = table["proved_rest_state"].tolist()
    assert known == [1, 0, 0, 1, 0]
    # The next call goes on.
    code, stdout, _ = interrupted(prove, 9, number, *words, "--json")
    assert code == 0
    data = json.loads(stdout)["proofs"]
    assert (data["reached"], data["members"]) == (5, {"proved": 5})


@pytest.mark.parametrize("number", CODES)
def test_a_proof_that_all_members_share(folder: Path, number: int) -> None:
    Path("starts.yaml").write_text(SHARED)
    code, stdout, stderr = interrupted(
        *("rbstab.sweep.proofs.convergence.keep_proofs", 1, number),
        *("sweep", "starts.yaml", "--threads", "1"),
    )
    assert code == CODES[signal.Signals(number)]
    stored = "all 2 members are stored in results/starts/members.h5"
    assert f"Interrupted: {stored}; missing: 1 proof of rest states.\n" in stderr
    assert "completed" in stdout
    assert len(read_sweep(Path("results/starts/members.h5"))["status"]) == 2
