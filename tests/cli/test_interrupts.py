"""Interrupts of runs, sweeps and their proofs: results stay, gaps are named, commands go on."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from cli.conftest import GOOD, restore_interrupts, start
from support.printed_paths import printed
from support.sweeps import shard_files

from rbstab.store.table import read_table
from rbstab.sweep.folder.sweep_folder import SHARD
from rbstab.sweep.folder.sweep_table import read_sweep

pytestmark = [
    pytest.mark.heavy,
    pytest.mark.skipif(sys.platform == "win32", reason="SIGINT cannot be sent to one process"),
]

CODES = {signal.SIGINT: 130, signal.SIGTERM: 143}

FILES = {
    "other.yaml": GOOD.replace("mass: 41", "mass: 42"),
    "endless.yaml": GOOD.replace("duration: 0.1, samples: 11", "duration: 1e6, samples: 2"),
    "bodies.yaml": "base: good.yaml\nvary: {body.mass: {linspace: [40, 44, 5]}}\n",
    "starts.yaml": "base: good.yaml\nvary:\n  initial.angular_velocity[1]: {values: [1, 2]}\n",
    "plan.yaml": "base: good.yaml\nvary: {body.mass: {linspace: [40, 44, 400]}}\n",
}

PROGRAM = """
import os, sys
from importlib import import_module
from rbstab_cli.main import main

place, count, number = sys.argv[1:4]
sys.argv[1:4] = []
module, _, function = place.rpartition(".")
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

STORE, PROVE = (f"rbstab.experiment.run_to_file.{name}" for name in ("run_to_file", "prove_run"))
PROVE_BODY = "rbstab.sweep.proofs.prove_bodies._prove"
KEEP = "rbstab.sweep.proofs.convergence.keep_proofs"

CASES = [
    (STORE, 2, "run good.yaml other.yaml --no-prove", "1 of 2 runs are stored"),
    (STORE, 1, "run good.yaml", "0 of 1 runs are stored"),
    (
        *(PROVE, 2, "run good.yaml other.yaml"),
        printed("2 of 2 runs are stored; the proofs of results/other.h5 are missing"),
    ),
    (
        *(PROVE_BODY, 2, "sweep bodies.yaml --threads 1"),
        "all 5 members are stored in results/bodies/members.h5; missing: the proofs of 3 of 5 "
        "distinct bodies: those of members 1 to 2, 4",
    ),
    (
        *(KEEP, 1, "sweep starts.yaml --threads 1"),
        "all 2 members are stored in results/starts/members.h5; missing: 1 proof of rest states",
    ),
]


@pytest.fixture
def files(folder):
    """The working folder with configs and plans."""
    for name, text in FILES.items():
        (folder / name).write_text(text)
    return folder


KILL = "os.kill(os.getpid(), int(number))"
WHILE_A_CLASS_IS_MADE = f"""
        class Name:
            def __set_name__(self, *_):
                {KILL}
        type("Made", (), {{"name": Name()}})
""".strip()
"""What a signal meets often while schemas are made. Python 3.11 raises a RuntimeError of it."""


def interrupted(place, count, number, words, program=PROGRAM):
    """Run a command that gets a signal as it calls a function for the `count`-th time."""
    done = subprocess.run(
        [sys.executable, "-c", program, place, str(count), str(int(number)), *words.split()],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=restore_interrupts,
    )
    assert "Traceback" not in done.stderr
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("number", CODES)
@pytest.mark.parametrize(("place", "count", "words", "said"), CASES)
@pytest.mark.usefixtures("files")
def test_what_is_stored_and_what_is_missing_is_said(place, count, words, said, number):
    code, stdout, stderr = interrupted(place, count, number, words)
    assert code == CODES[number]
    assert f"Interrupted: {said}.\n" in stderr
    again = "to start again from t = 0" if said.startswith("0") else "again to resume"
    assert stderr.endswith(f"Run the same command {again}.\n")
    # What is stored is printed.
    assert bool(stdout) != said.startswith("0")


@pytest.mark.parametrize("number", CODES)
@pytest.mark.usefixtures("files")
def test_an_interrupt_that_python_turns_into_an_error_is_one(number):
    program = PROGRAM.replace(KILL, WHILE_A_CLASS_IS_MADE)
    code, _, stderr = interrupted("rbstab.config.load.loaded", 1, number, "run good.yaml", program)
    assert (code, stderr) == (CODES[number], "Interrupted.\n")


def test_proofs_that_were_made_are_kept_and_the_others_follow(files):
    """The proof that is running is finished; the first two are those of 40 and 43 kg."""
    words = "sweep bodies.yaml --threads 1 --json"
    code, stdout, _ = interrupted(PROVE_BODY, 2, signal.SIGINT, words)
    assert code == 130
    proofs = json.loads(stdout)["proofs"]
    assert (proofs["interrupted"], proofs["reached"]) == (True, 2)
    assert proofs["members_not_reached"] == [[1, 2], [4, 4]]
    table = read_sweep(Path("results/bodies/members.h5"))
    assert table["proved_rest_state"].tolist() == [1, 0, 0, 1, 0]
    code, stdout, _ = interrupted(PROVE_BODY, 9, signal.SIGINT, words)
    assert code == 0
    data = json.loads(stdout)["proofs"]
    assert (data["reached"], data["members"]) == (5, {"proved": 5})


def test_a_result_of_an_older_config_does_not_count(files):
    words = "run good.yaml --no-prove --force"
    assert interrupted(STORE, 9, signal.SIGINT, words)[0] == 0
    Path("good.yaml").write_text(GOOD.replace("samples: 11", "samples: 21"))
    code, _, stderr = interrupted(STORE, 1, signal.SIGINT, words)
    assert code == 130
    assert "Interrupted: 0 of 1 runs are stored." in stderr


def test_an_endless_run_ends_and_what_is_done_is_kept(files):
    process = start("run", "--no-prove", "good.yaml", "endless.yaml")
    deadline = time.monotonic() + 60
    while not Path("results/good.h5").exists():
        assert time.monotonic() < deadline
        time.sleep(0.01)
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    stdout, stderr = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Interrupted: 1 of 2 runs are stored." in stderr
    assert "Traceback" not in stderr
    assert "results/good.h5" in stdout
    assert [path.name for path in Path("results").iterdir()] == ["good.h5"]


@pytest.mark.parametrize("part", ["", "1/2"])
def test_shards_of_a_sweep_are_whole(part, files):
    words = "sweep --no-prove plan.yaml --engine scipy --shard-size 4"
    words += " --set integration.duration=0.2" + (f" --part {part}" if part else "")
    sweep = Path("results/plan")
    for presses in (1, 2):
        before = len(shard_files(sweep)) if sweep.exists() else 0
        with start(*words.split()) as process:
            while not sweep.exists() or len(shard_files(sweep)) == before:
                assert process.poll() is None
                time.sleep(0.01)
            for _ in range(presses):
                process.send_signal(signal.SIGINT)
                time.sleep(0.02)
            _, stderr = process.communicate(timeout=30)
        assert process.returncode == 130
        assert "Run the same command again to resume." in stderr
        if presses == 1:
            assert ("of 50 shards of part 1/2 are stored." in stderr) == bool(part)
        for name in shard_files(sweep):
            assert len(read_table(sweep / "shards" / name, SHARD)["run"]) == 4
            assert not part or int(Path(name).stem) % 2 == 0
