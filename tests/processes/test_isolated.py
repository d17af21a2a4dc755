"""Protects against functions that hang, crash or fill the memory: only their worker is killed."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
import support
from support.isolated_calls import (
    TwoArgumentsError,
    call_again,
    crash,
    double,
    fail,
    fail_unpicklably,
    give_zeros,
    hang,
    leave,
    process_of,
    take,
    wait_and_return,
)

import rbstab.processes.isolated
from rbstab.processes.isolated import (
    CrashError,
    DeadlineError,
    IsolatedFunction,
    Limits,
    isolated,
)
from rbstab.processes.workers import WorkerDiedError

MEBIBYTE = 1 << 20

KILLS = [signal.SIGKILL] if sys.platform != "win32" else []

ENOUGH = Limits(60.0, 500 * MEBIBYTE)

PATIENCE = 60.0
"""s; far more than a loaded machine needs to end a process."""

ENVIRONMENT = os.environ | {"PYTHONPATH": str(Path(support.__file__).parent.parent)}

PARENT_IMPORTS = (
    "import sys",
    "from pathlib import Path",
    "from support import isolated_calls",
    "from rbstab.processes.isolated import IsolatedFunction, Limits, isolated",
)

PARENT = """
function = getattr(isolated_calls, sys.argv[1])
isolated(function, Path(sys.argv[2]), Limits(float(sys.argv[3]), 1 << 30))
"""


def test_value_is_returned():
    assert isolated(double, 21, ENOUGH) == 42


def test_one_worker_serves_many_calls_and_is_ended():
    with IsolatedFunction(process_of) as call:
        workers = {call(None, ENOUGH) for _ in range(3)}
    assert len(workers) == 1
    assert os.getpid() not in workers
    assert not psutil.pid_exists(workers.pop())


def test_relative_paths_mean_the_same_in_the_worker(tmp_path, monkeypatch):
    with IsolatedFunction(os.path.abspath) as call:
        call("a", ENOUGH)
        monkeypatch.chdir(tmp_path)
        assert call("a", ENOUGH) == str(tmp_path / "a")


@pytest.mark.parametrize("error", [ValueError("wrong"), KeyError("name"), RecursionError("deep")])
def test_exceptions_are_passed_on(error):
    with IsolatedFunction(fail) as call:
        with pytest.raises(type(error)) as caught:
            call(error, ENOUGH)
        assert caught.value.args == error.args
        with pytest.raises(OSError, match="next"):
            call(OSError("next"), ENOUGH)


def test_exception_that_cannot_be_pickled_keeps_its_text():
    with pytest.raises(TypeError):
        TwoArgumentsError(*TwoArgumentsError("one", "two").args)
    with pytest.raises(RuntimeError, match="TwoArgumentsError: one, two"):
        isolated(fail_unpicklably, None, ENOUGH)


def test_hanging_call_ends_at_its_deadline():
    start = time.monotonic()
    with IsolatedFunction(hang) as call:
        with pytest.raises(DeadlineError, match=r"took more than 0\.3 s"):
            call(600, Limits(0.3, MEBIBYTE))
        assert time.monotonic() - start < PATIENCE
        assert call(0, ENOUGH) is None


def test_late_answer_is_not_taken_for_the_answer_of_the_next_call():
    with IsolatedFunction(wait_and_return) as call:
        with pytest.raises(DeadlineError):
            call((2.0, "late"), Limits(0.5, MEBIBYTE))
        assert call((2.0, "next"), ENOUGH) == "next"


# Windows has no SIGKILL.
@pytest.mark.parametrize("number", [signal.SIGSEGV, signal.SIGABRT, *KILLS])
def test_crash_leaves_this_process_unharmed(number, capfd):
    with IsolatedFunction(crash) as call:
        for _ in range(2):
            with pytest.raises(CrashError, match="crashed"):
                call(number, ENOUGH)
    assert capfd.readouterr() == ("", "")


def test_function_that_ends_its_process():
    with pytest.raises(CrashError):
        isolated(leave, 0, ENOUGH)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux enforces a memory limit")
def test_memory_is_limited_for_one_call():
    with IsolatedFunction(take) as call:
        with pytest.raises(MemoryError):
            call(400 * MEBIBYTE, Limits(60.0, 300 * MEBIBYTE))
        assert call(200 * MEBIBYTE, Limits(60.0, 300 * MEBIBYTE)) == 200 * MEBIBYTE
        assert call(400 * MEBIBYTE, ENOUGH) == 400 * MEBIBYTE


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux enforces a memory limit")
def test_value_that_does_not_fit_twice_in_memory():
    """The answer is copied once before it is sent."""
    with pytest.raises(MemoryError):
        isolated(give_zeros, 200 * MEBIBYTE, Limits(60.0, 300 * MEBIBYTE))


def test_worker_calls_directly():
    inner, worker, number = isolated(call_again, 3, ENOUGH)
    assert (inner, number) == (worker, 3)
    assert worker != os.getpid()


def test_worker_that_does_not_start(monkeypatch):
    monkeypatch.setattr(rbstab.processes.isolated, "START_LIMIT", 0.0)
    with pytest.raises(WorkerDiedError, match="did not start"):
        isolated(double, 1, ENOUGH)


def test_worker_ends_with_its_function():
    call = IsolatedFunction(process_of)
    worker = call(None, ENOUGH)
    assert psutil.pid_exists(worker)
    del call
    assert has_ended(worker)


def test_process_with_an_idle_worker_ends():
    script = "\n".join([*PARENT_IMPORTS, "call = IsolatedFunction(isolated_calls.double)"])
    script += "\nprint(call(21, Limits(60.0, 1 << 30)))"
    done = subprocess.run(
        [sys.executable, "-c", script],
        env=ENVIRONMENT,
        capture_output=True,
        timeout=PATIENCE,
        check=True,
        text=True,
    )
    assert (done.stdout, done.stderr) == ("42\n", "")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("function", "deadline"),
    [("write_pid_and_sleep", 600.0), ("hang_all_threads", 5.0)],
    ids=["other threads run", "no other thread runs"],
)
def test_worker_ends_after_its_parent_is_killed(tmp_path, function, deadline):
    """In the second case only the alarm can end it: 2 s after the deadline."""
    pid_file, script = tmp_path / "pid", "\n".join([*PARENT_IMPORTS, PARENT])
    parent = subprocess.Popen(
        [sys.executable, "-c", script, function, pid_file, str(deadline)], env=ENVIRONMENT
    )
    with parent:
        wait_for(lambda: pid_file.exists() and pid_file.read_text())
        parent.kill()
    worker = int(pid_file.read_text())
    wait_for(lambda: has_ended(worker))


def has_ended(number):
    try:
        return psutil.Process(number).status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


def wait_for(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.05)
