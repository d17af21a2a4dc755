"""Protects the execution of a sweep: it resumes, and results do not depend on threads or stops."""

import functools
import time

import numpy as np
import pytest
from support.configs import EMBEDDED, plain
from support.sweeping import HARMS, Listener, digest_of, harmed, run_sweep
from support.sweeps import SHORT, FakeEngine, plan_of, plan_with_traces, shard_files

from rbstab.sweep.execution.events import ShardDone, Started, Warned
from rbstab.sweep.folder.member_answers import member_answers
from rbstab.sweep.folder.members_file import counts_by_status
from rbstab.sweep.folder.sweep_table import read_sweep
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.sweep import sweep_to_folder


def test_nothing_done_is_redone(tmp_path):
    run_sweep(tmp_path / "a")
    before = (tmp_path / "a" / "members.h5").stat()
    listener = Listener()
    assert run_sweep(tmp_path / "a", listener=listener, shard_size=None).finished
    assert [type(event) for event in listener.events] == [Started]
    after = (tmp_path / "a" / "members.h5").stat()
    # Reading the file changes only its access time.
    assert (after.st_ino, after.st_mtime_ns) == (before.st_ino, before.st_mtime_ns)


@pytest.mark.parametrize("harm", [*HARMS, "remove", "other"])
@pytest.mark.parametrize("kind", ["shards", "traces"])
def test_a_damaged_file_of_a_shard_is_made_again(tmp_path, harm, kind):
    plan, path = plan_with_traces(), tmp_path / "a"
    run_sweep(path, plan)
    before = {name: shard_files(path, name) for name in ("shards", "traces")}
    file, digest = path / kind / "00000004.h5", digest_of(path)
    if harm == "remove":
        file.unlink()
    elif harm == "other":
        run_sweep(tmp_path / "b", plan_with_traces(base={**plain(EMBEDDED), "integration": SHORT}))
        file.write_bytes((tmp_path / "b" / kind / file.name).read_bytes())
    else:
        file.write_bytes(harmed(file.read_bytes(), before[kind]["00000003.h5"], harm))
    listener = Listener()
    assert run_sweep(path, plan, listener).finished
    assert listener.computed == [4]
    assert {name: shard_files(path, name) for name in before} == before
    assert digest_of(path) == digest


def test_a_damaged_or_missing_members_file_is_written_again(tmp_path):
    run_sweep(tmp_path / "a")
    path = tmp_path / "a" / "members.h5"
    digest = digest_of(tmp_path / "a")
    for harm in (path.unlink, lambda: path.write_bytes(path.read_bytes()[:-1])):
        harm()
        listener = Listener()
        assert run_sweep(tmp_path / "a", listener=listener).finished
        assert listener.computed == []
        assert digest_of(tmp_path / "a") == digest


def test_members_that_fail(tmp_path):
    path, plan = tmp_path / "a", plan_with_traces()
    done = run_sweep(path, plan, factory=functools.partial(FakeEngine, failing=(17, 18, 55)))
    assert done.finished
    expected = {"completed": 57, "diverged": 3}
    assert counts_by_status(done.inventory.counts) == expected
    assert member_answers(path / "members.h5").summary["by_status"] == expected
    assert read_sweep(path / "members.h5").words("status")[17] == "diverged"
    listener = Listener()
    done = run_sweep(path, plan, listener, retry_failed=True)
    assert listener.computed == [1, 5]
    assert counts_by_status(done.inventory.counts) == {"completed": 60}
    run_sweep(tmp_path / "b", plan)
    for kind in ("shards", "traces"):
        assert shard_files(path, kind) == shard_files(tmp_path / "b", kind)


def test_stopping_at_the_first_that_fails(tmp_path):
    path = tmp_path / "a"
    failing = functools.partial(FakeEngine, failing=(17, 55), delay=1e-4)
    listener = Listener()
    done = run_sweep(path, listener=listener, factory=failing, fail_fast=True, threads=1)
    assert not done.finished
    assert listener.computed == [0, 1]
    assert done.inventory.first_failed == 17
    listener = Listener()
    assert not run_sweep(path, listener=listener, fail_fast=True).finished
    assert listener.computed == []
    listener = Listener()
    assert run_sweep(path, listener=listener, fail_fast=True, retry_failed=True).finished
    assert listener.computed == list(range(1, 6))


def test_an_engine_that_raises_ends_nothing(tmp_path):
    plan = plan_of(12, base=quick())
    listener = Listener()
    raising = functools.partial(FakeEngine, raising=(4,))
    done = run_sweep(tmp_path / "a", plan, listener, factory=raising, shard_size=3)
    assert done.finished
    (failure,) = listener.of(Warned)
    assert failure.text.startswith(
        "the engine failed at members 3 to 5 (ZeroDivisionError: made up); "
    )
    assert counts_by_status(done.inventory.counts) == {"completed": 12}


@pytest.mark.parametrize("error", [MemoryError, KeyboardInterrupt])
def test_an_error_of_whoever_listens_loses_nothing(tmp_path, error):
    def on_event(event):
        if isinstance(event, ShardDone):
            raise error

    slow = functools.partial(FakeEngine, delay=1e-3)
    options = SweepOptions(factory=slow, shard_size=10, threads=2)
    with pytest.raises(error):
        sweep_to_folder(plan_of(), tmp_path / "a", options, on_event)
    time.sleep(0.05)
    assert run_sweep(tmp_path / "a").finished


def quick(**integration):
    """Return a base whose single run takes a few milliseconds."""
    base = plan_of(1).templates["visco-elastic"]
    return {**base, "integration": {"duration": 0.02, "samples": 3, "rtol": 1e-6, **integration}}


def test_real_members(tmp_path):
    """The engine is scipy itself, so the members are single runs."""
    plan = plan_of(20, base=quick())
    done = sweep_to_folder(plan, tmp_path / "a", SweepOptions(threads=2))
    table = read_sweep(done.folder.sweep_file)
    assert set(table.words("status")) == {"completed"}
    assert np.isfinite(table["final_position"]).all()
    assert (table["final_connector_state"] != table["final_connector_state"]).all()
    assert np.allclose(table["end_time"], 0.02)


def test_the_check_finds_what_is_wrong(tmp_path):
    plan = plan_of(20, base=quick(engine="heyoka"))
    options = SweepOptions(lambda plan: SingleRuns(plan, "scipy"), shard_size=8, compare=3)
    check = sweep_to_folder(plan, tmp_path / "a", options).comparison
    assert check is not None
    assert (len(check.members), check.unlike) == (3, 0)
    assert set(check.differences.values()) == {0.0}
    options = SweepOptions(FakeEngine, compare=3)
    wrong = sweep_to_folder(plan, tmp_path / "b", options).comparison
    assert wrong is not None
    assert wrong.members == check.members
    assert wrong.unlike == 3  # Made up members settle; a run of 0.02 s does not.
    table = read_sweep(tmp_path / "b" / "members.h5")
    assert table.attributes["checked_members"] == 3
    assert table.attributes["checked_unlike"] == 3
    assert "lyapunov_end" in table["check_column"].tolist()


def test_more_members_may_be_compared_later(tmp_path):
    """A stored comparison is kept, unless another number is asked for."""
    plan, path = plan_of(20, base=quick(engine="heyoka")), tmp_path / "a"

    def compared(count):
        options = SweepOptions(lambda plan: SingleRuns(plan, "scipy"), compare=count)
        check = sweep_to_folder(plan, path, options).comparison
        assert check is not None
        assert read_sweep(path / "members.h5").attributes["checked_members"] == len(check.members)
        return check.members

    first = compared(None)
    assert len(first) == 4
    gathered = (path / "members.h5").stat().st_mtime_ns
    assert compared(None) == first
    assert (path / "members.h5").stat().st_mtime_ns == gathered
    assert len(compared(9)) == 9
    assert len(compared(None)) == 9


@pytest.mark.parametrize(
    "wrong", [{"threads": 0}, {"threads": -1}, {"shard_size": 0}, {"compare": 0}]
)
def test_a_sweep_by_nobody_is_refused(wrong):
    with pytest.raises(
        ValueError, match=r"(threads|shard_size|compare) is -?\d \(expected at least 1\)"
    ):
        SweepOptions(**wrong)
