"""Failed system calls, one by one: no command loses a result, stores a wrong one, or shows debris.

A preloaded library fails the Nth call of a kind on files in the folder of results. After each fault
the exit code and the messages are checked, and all files are compared with those of an undisturbed
run, array by array. Then the command is repeated undisturbed. The command may not crash or hang.
"""

import os
import subprocess
import sys

import pytest
from faults.library.cases import CASES, INPUTS
from faults.library.control import CAN_BUILD, SHORT, Control, Fault, build
from faults.library.trials import problems_of, running

pytestmark = pytest.mark.skipif(not CAN_BUILD, reason="no C compiler")

ONCE, LASTING = False, True

SOME = {
    "run": (
        ("open", "EIO", LASTING),
        ("open", "EIO", ONCE),
        ("write", "ENOSPC", ONCE),
        ("fsync", "EIO", ONCE),
        ("link", "EIO", ONCE),
    ),
    "run replacing": (("rename", "EIO", ONCE),),
    "sweep": (("open", "EIO", ONCE), ("rename", "EIO", ONCE), ("link", "EIO", ONCE)),
    "sweep after its parts": (
        ("write", "EIO", ONCE),
        ("close", "EIO", ONCE),
        ("space", "ENOSPC", LASTING),
    ),
    "report text": (("write", "ENOSPC", ONCE),),
}
"""Faults that are tried at some of the calls of each operation."""

ALL = [
    *((operation, "EIO", ONCE) for operation in ("open", "write", "pwrite", "close", "fsync")),
    *((operation, "EIO", ONCE) for operation in ("rename", "link", "ftruncate", "flock")),
    *((operation, "EIO", ONCE) for operation in ("unlink", "mkdir", "read")),
    *((operation, "EIO", LASTING) for operation in ("open", "write", "close", "fsync", "rename")),
    *((operation, "EIO", LASTING) for operation in ("link", "flock", "unlink", "read")),
    ("space", "ENOSPC", ONCE),
    ("space", "ENOSPC", LASTING),
    ("flock", "ENOLCK", LASTING),
    ("write", SHORT, ONCE),
    ("write", SHORT, LASTING),
    ("read", SHORT, LASTING),
]

READS = 40
"""Calls of `read` that are disturbed in a report: it makes hundreds, all by the same functions."""


@pytest.fixture(scope="module")
def harness(tmp_path_factory):
    with running(tmp_path_factory.mktemp("faults")) as started:
        yield started


def name_of(fault):
    """Return a name of a fault, or of a case, for the name of a test."""
    if isinstance(fault, tuple):
        operation, error, lasting = fault
        return f"{operation} {error}{' lasting' if lasting else ''}"
    return str(fault)


@pytest.mark.parametrize(
    "case",
    [
        "run",
        "run replacing",
        "sweep",
        "sweep after its parts",
        pytest.param("report text", marks=pytest.mark.slow),
    ],
)
def test_some_failed_calls(harness, case):
    for operation, error, lasting in SOME[case]:
        trials = harness.series(case, operation, error, lasting=lasting, sample=3)
        assert any(trial.counts.faults for trial in trials), f"{operation} never failed"
        assert problems_of(trials) == ""


@pytest.mark.long
@pytest.mark.parametrize("fault", ALL, ids=name_of)
@pytest.mark.parametrize("case", CASES, ids=name_of)
def test_every_failed_call(harness, case, fault):
    operation, error, lasting = fault
    sample = READS if operation == "read" and case.startswith("report") else None
    trials = harness.series(case, operation, error, lasting=lasting, sample=sample)
    assert problems_of(trials) == ""


def test_no_command_writes_through_hdf5(harness):
    """HDF5 writes by `pwrite` and sizes files by `ftruncate`; it loses errors of both."""
    for case in ("run replacing", "sweep", "sweep after its parts"):
        for operation in ("pwrite", "ftruncate"):
            assert harness.series(case, operation) == []


def test_a_process_of_its_own_ends_in_the_same_way(tmp_path, harness):
    """The commands of the other tests run in forks of one process."""
    (trial,) = harness.series("run", "write", sample=1)
    variables = build(tmp_path)
    results = tmp_path / "results"
    results.mkdir()
    for name, text in INPUTS.items():
        (tmp_path / name).write_text(text)
    Control(tmp_path / "control").arm(results, Fault("write", "EIO", 1, lasting=False))
    ended = subprocess.run(
        [sys.executable, "-m", "rbstab_cli", *CASES["run"].arguments.split()],
        cwd=tmp_path,
        env=os.environ | variables,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert (ended.returncode, ended.stderr) == (trial.ended.code, trial.ended.stderr)
    assert list(results.iterdir()) == []


SCRIPT = """
import fcntl, os, sys
folder = sys.argv[1]
failed = []
def attempt(name, call, *arguments):
    try:
        return call(*arguments)
    except OSError as error:
        failed.append(f"{name} {error.errno}")
os.mknod(f"{folder}/e")
file = os.open(f"{folder}/a", os.O_CREAT | os.O_RDWR)
os.chdir(folder)
attempt("open", os.open, "a", os.O_RDONLY)
print(attempt("write", os.write, file, b"12345678"))
attempt("pwrite", os.pwrite, file, b"12345678", 0)
attempt("read", os.pread, file, 8, 0)
attempt("fsync", os.fsync, file)
attempt("fsync", os.fdatasync, file)
attempt("ftruncate", os.ftruncate, file, 4)
attempt("flock", fcntl.flock, file, fcntl.LOCK_EX)
attempt("link", os.link, "a", "b")
attempt("rename", os.rename, "a", "c")
attempt("mkdir", os.mkdir, "d")
attempt("unlink", os.unlink, "e")
attempt("close", os.close, file)
outside = os.open(f"{folder}-not/a", os.O_CREAT | os.O_RDWR)
os.write(outside, b"1")
os.close(outside)
print(*failed, sep=",")
"""
"""Makes each call that the library can fail, and prints those that failed."""


@pytest.mark.parametrize(
    ("fault", "written", "failed"),
    [
        *(
            (Fault(operation, "EIO", nth, lasting=False), 8, f"{operation} 5")
            for operation, nth in {
                "open": 2,
                "pwrite": 1,
                "close": 1,
                "fsync": 2,
                "rename": 1,
                "link": 1,
                "ftruncate": 1,
                "flock": 1,
                "unlink": 1,
                "mkdir": 1,
                "read": 1,
            }.items()
        ),
        (Fault("write", "ENOSPC", 1, lasting=False), None, "write 28"),
        (Fault("write", SHORT, 1, lasting=False), 4, ""),
        (Fault("fsync", "EIO", 1, lasting=True), 8, "fsync 5,fsync 5"),
        (
            Fault("space", "ENOSPC", 2, lasting=True),
            None,
            "write 28,pwrite 28,ftruncate 28,mkdir 28",
        ),
        (Fault("fsync", "EIO", 3, lasting=False), 8, ""),
    ],
    ids=str,
)
def test_the_library_fails_the_chosen_call(tmp_path, fault, written, failed):
    """Only the chosen call fails, and calls outside the folder never do."""
    inside = tmp_path / "results"
    for folder in (inside, tmp_path / "results-not"):
        folder.mkdir()
    variables = build(tmp_path)
    control = Control(tmp_path / "control")
    control.arm(inside, fault)
    ended = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(inside)],
        env=variables,
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    counts = control.disarm()
    assert ended.stdout.splitlines() == [str(written), failed]
    expected = ["write"] if fault.error == SHORT else failed.split(",") if failed else []
    assert counts.faults == len(expected)
    assert (str(inside) in counts.first) == bool(expected)
