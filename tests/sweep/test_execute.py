"""A sweep goes on where it stopped; neither threads nor interruptions show in what it stores."""

import functools
import json
import random
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import xarray
from support.sweeps import FakeEngine, plan_of, shard_files

import rbstab
from rbstab.config.load import run_id
from rbstab.store.errors import NotAResultError, ResultExistsError, StoreError
from rbstab.store.lock import FolderInUseError, locked
from rbstab.store.table_file import read_table
from rbstab.sweep.execute import ShardDone, Trouble
from rbstab.sweep.folder import open_folder
from rbstab.sweep.gather import counts_by_status, sweep_summary
from rbstab.sweep.layout import varied_layout
from rbstab.sweep.load import load_plan
from rbstab.sweep.single import SingleRuns
from rbstab.sweep.sweep import Started, Ways, sweep_to_folder


class Listener:
    """Keeps what happens, and stops the sweep after some shards."""

    def __init__(self, shards=None):
        self.events = []
        self.stop = threading.Event()
        self.shards = shards

    def __call__(self, event):
        if event is not None:
            self.events.append(event)
        if self.shards is not None and len(self.of(ShardDone)) >= self.shards:
            self.stop.set()

    def of(self, kind):
        return [event for event in self.events if isinstance(event, kind)]

    @property
    def computed(self):
        return sorted(event.number for event in self.of(ShardDone))


def swept(path, plan=None, listener=None, factory=FakeEngine, **ways):
    """Sweeps a plan whose engine is scipy by name, so that nothing is repeated as a single run."""
    listener = listener or Listener()
    ways = Ways(**{"factory": factory, "shard_size": 10, "threads": 2, **ways})
    return sweep_to_folder(plan or plan_of(), path, ways, listener, listener.stop)


def digest_of(path):
    return read_table(path / "sweep.h5").attributes["arrays_digest"]


def test_what_is_stored(tmp_path):
    plan = plan_of()
    done = swept(tmp_path / "a", plan)
    assert done.finished
    assert counts_by_status(done.survey.counts) == {"completed": 60}
    table = read_table(tmp_path / "a" / "sweep.h5")
    engine = FakeEngine(plan)
    expected = engine.compute(0, 60).outcome
    for name, data in expected.items():
        assert table[name].tobytes() == data.tobytes(), name
    spins = plan.values(0, 60)["initial.angular_velocity[0]"]
    assert (table["initial_angular_velocity_0"] == spins).all()
    assert table.layout["initial_angular_velocity_0"].unit == "rad/s"
    assert table["grid_axis"].tolist() == ["initial.angular_velocity[0]"]
    assert table["plan"].item() == (tmp_path / "a" / "plan.yaml").read_text()
    manifest = json.loads((tmp_path / "a" / "manifest.json").read_text())
    assert manifest["plan_id"] == table.attributes["plan_id"] == done.folder.manifest.plan_id
    assert rbstab.open_sweep(tmp_path / "a").shaped("steps").shape == (60,)
    summary = sweep_summary(done.folder.sweep_file)
    assert (summary.members, summary.by_status) == (60, {"completed": 60})


def test_threads_shards_and_stops_do_not_show(tmp_path):
    plan = plan_of(100)
    swept(tmp_path / "1", plan, threads=1)
    swept(tmp_path / "2", plan, threads=5)
    assert shard_files(tmp_path / "1") == shard_files(tmp_path / "2")
    swept(tmp_path / "3", plan, shard_size=33)
    for count in (1, 2):
        listener = Listener(count)
        slow = functools.partial(FakeEngine, delay=1e-3)
        assert not swept(tmp_path / "4", plan, listener=listener, factory=slow).finished
        assert not (tmp_path / "4" / "sweep.h5").exists()
    last = Listener()
    assert swept(tmp_path / "4", plan, listener=last).finished
    assert 0 < len(last.computed) < 10
    assert len({digest_of(tmp_path / name) for name in "1234"}) == 1


def test_nothing_done_is_redone(tmp_path):
    swept(tmp_path / "a")
    before = (tmp_path / "a" / "sweep.h5").stat()
    listener = Listener()
    assert swept(tmp_path / "a", listener=listener, shard_size=None).finished
    assert [type(event) for event in listener.events] == [Started]
    after = (tmp_path / "a" / "sweep.h5").stat()
    # Reading it moves the time of the last access alone.
    assert (after.st_ino, after.st_mtime_ns) == (before.st_ino, before.st_mtime_ns)


@pytest.mark.parametrize("harm", ["flip", "cut", "empty", "swap", "remove", "other"])
def test_a_damaged_shard_is_made_again(tmp_path, harm):
    swept(tmp_path / "a")
    before, digest = shard_files(tmp_path / "a"), digest_of(tmp_path / "a")
    shard = tmp_path / "a" / "shards" / "00000004.h5"
    content = shard.read_bytes()
    if harm == "remove":
        shard.unlink()
    elif harm == "other":
        swept(tmp_path / "b", plan_of(base="configs/paper/case2_visco_elastic.yaml"))
        shard.write_bytes((tmp_path / "b" / "shards" / "00000004.h5").read_bytes())
    else:
        shard.write_bytes(
            {
                "flip": content[:4000] + bytes([content[4000] ^ 1]) + content[4001:],
                "cut": content[:-100],
                "empty": b"",
                "swap": before["00000003.h5"],
            }[harm]
        )
    listener = Listener()
    assert swept(tmp_path / "a", listener=listener).finished
    assert listener.computed == [4]
    assert shard_files(tmp_path / "a") == before
    assert digest_of(tmp_path / "a") == digest


def test_a_damaged_or_missing_sweep_file_is_gathered_again(tmp_path):
    swept(tmp_path / "a")
    path = tmp_path / "a" / "sweep.h5"
    digest = digest_of(tmp_path / "a")
    for harm in (path.unlink, lambda: path.write_bytes(path.read_bytes()[:-1])):
        harm()
        listener = Listener()
        assert swept(tmp_path / "a", listener=listener).finished
        assert listener.computed == []
        assert digest_of(tmp_path / "a") == digest


def test_a_different_plan_is_refused_or_moves_the_old_one_aside(tmp_path):
    path = tmp_path / "a"
    swept(path)
    before, name = shard_files(path), open_folder(path).manifest.plan_id[:8]
    for other in ({"plan": plan_of(59)}, {"shard_size": 20}):
        with pytest.raises(ResultExistsError, match="--force"):
            swept(path, **other)
    assert shard_files(path) == before
    listener = Listener()
    swept(path, plan_of(59), listener, force=True)
    aside = tmp_path / f"a.{name}"
    assert listener.of(Started)[0].kept_aside == aside
    assert shard_files(aside) == before
    swept(path, plan_of(58), force=True)
    swept(path, plan_of(60), force=True)
    swept(path, plan_of(57), force=True)
    assert (tmp_path / f"a.{name}-1").is_dir()
    # The same plan goes on: there is nothing to be moved.
    again = Listener()
    swept(path, plan_of(57), again, force=True)
    assert (again.computed, again.of(Started)[0].kept_aside) == ([], None)


def test_a_title_is_no_difference(tmp_path):
    swept(tmp_path / "a")
    assert swept(tmp_path / "a", plan_of(title="Another")).finished


def test_other_things_in_the_folder(tmp_path):
    path = tmp_path / "a"
    path.mkdir()
    (path / "thesis.tex").write_text("")
    with pytest.raises(ResultExistsError, match=r"other things \(thesis.tex\)"):
        swept(path)
    swept(path, force=True)
    assert (tmp_path / "a.damaged" / "thesis.tex").exists()
    (tmp_path / "file").write_text("")
    with pytest.raises(StoreError, match="cannot be written"):
        swept(tmp_path / "file")
    with pytest.raises(NotAResultError):
        open_folder(tmp_path)


def test_a_damaged_manifest(tmp_path):
    path = tmp_path / "a"
    swept(path)
    (path / "manifest.json").write_text("{}")
    with pytest.raises(ResultExistsError, match="damaged"):
        swept(path)
    assert swept(path, force=True).finished


def test_what_somebody_has_removed_comes_back(tmp_path):
    path = tmp_path / "a"
    swept(path)
    before = shard_files(path)
    shutil.rmtree(path / "shards")
    (path / "plan.yaml").unlink()
    assert swept(path).finished
    assert shard_files(path) == before
    assert (path / "plan.yaml").read_text() == read_table(path / "sweep.h5")["plan"].item()


def test_other_versions_are_told(tmp_path, monkeypatch):
    swept(tmp_path / "a")
    monkeypatch.setattr(np, "__version__", "99.0")
    listener = Listener()
    swept(tmp_path / "a", listener=listener)
    (changed,) = listener.of(Started)[0].changed
    assert changed.startswith("numpy ")
    assert changed.endswith(" -> 99.0")


def test_killed_before_the_manifest_was_there(tmp_path):
    path = tmp_path / "a"
    (path / "shards").mkdir(parents=True)
    (path / "plan.yaml").write_text("title")
    (path / ".manifest.json.0123.part").write_text("")
    assert swept(path).finished
    assert not list(path.glob(".*.part"))


def test_two_sweeps_into_one_folder(tmp_path):
    path = tmp_path / "a"
    swept(path)
    with locked(path):
        for force in (False, True):
            with pytest.raises(FolderInUseError, match="in use by another process"):
                swept(path, plan_of(59), force=force)


def test_members_that_fail(tmp_path):
    path = tmp_path / "a"
    failing = functools.partial(FakeEngine, failing=(17, 18, 55))
    done = swept(path, factory=failing)
    assert done.finished
    expected = {"completed": 57, "diverged": 3}
    assert counts_by_status(done.survey.counts) == expected
    assert sweep_summary(path / "sweep.h5").by_status == expected
    assert read_table(path / "sweep.h5").words("status")[17] == "diverged"
    listener = Listener()
    done = swept(path, listener=listener, retry_failed=True)
    assert listener.computed == [1, 5]
    assert sweep_summary(path / "sweep.h5").by_status == {"completed": 60}


def test_stopping_at_the_first_that_fails(tmp_path):
    path = tmp_path / "a"
    failing = functools.partial(FakeEngine, failing=(17, 55), delay=1e-4)
    listener = Listener()
    done = swept(path, listener=listener, factory=failing, fail_fast=True, threads=1)
    assert not done.finished
    assert listener.computed == [0, 1]
    assert done.survey.first_failed == 17
    listener = Listener()
    assert not swept(path, listener=listener, fail_fast=True).finished
    assert listener.computed == []
    listener = Listener()
    assert swept(path, listener=listener, fail_fast=True, retry_failed=True).finished
    assert listener.computed == list(range(1, 6))


def test_an_engine_that_raises_ends_nothing(tmp_path):
    plan = plan_of(12, base=quick())
    listener = Listener()
    raising = functools.partial(FakeEngine, raising=(4,))
    done = swept(tmp_path / "a", plan, listener, factory=raising, shard_size=3)
    assert done.finished
    (trouble,) = listener.of(Trouble)
    assert (trouble.start, trouble.stop) == (3, 6)
    assert counts_by_status(done.survey.counts) == {"completed": 12}


def test_an_engine_that_returns_nonsense(tmp_path):
    class Wrong(FakeEngine):
        def compute(self, start, stop):
            shard = super().compute(start, stop)
            shard.outcome["steps"] = shard.outcome["steps"][1:]
            return shard

    listener = Listener()
    assert swept(tmp_path / "a", plan_of(2, base=quick()), listener, factory=Wrong).finished
    assert "steps" in str(listener.of(Trouble)[0].error)


@pytest.mark.parametrize("error", [MemoryError, KeyboardInterrupt])
def test_an_error_of_whoever_listens_loses_nothing(tmp_path, error):
    def told(event):
        if isinstance(event, ShardDone):
            raise error

    slow = functools.partial(FakeEngine, delay=1e-3)
    ways = Ways(factory=slow, shard_size=10, threads=2)
    with pytest.raises(error):
        sweep_to_folder(plan_of(), tmp_path / "a", ways, told)
    time.sleep(0.05)
    assert swept(tmp_path / "a").finished


def test_a_full_disk_stops_the_sweep(tmp_path, monkeypatch):
    def full(*_):
        raise StoreError("a.h5 cannot be written: No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("rbstab.sweep.folder.write_shard", full)
        with pytest.raises(StoreError, match="No space left"):
            swept(tmp_path / "a")
    assert swept(tmp_path / "a").finished


def quick(**integration):
    """A base whose single run takes some milliseconds."""
    base = plan_of(1).templates["visco-elastic"]
    return {**base, "integration": {"duration": 0.02, "samples": 3, "rtol": 1e-6, **integration}}


def test_real_members(tmp_path):
    """The single runs themselves, and their check: engines are independent of each other."""
    plan = plan_of(20, base=quick())
    done = sweep_to_folder(plan, tmp_path / "a", Ways(threads=2))
    table = read_table(done.folder.sweep_file)
    assert set(table.words("status")) == {"completed"}
    assert np.isfinite(table["final_position"]).all()
    assert (table["final_connector_state"] != table["final_connector_state"]).all()
    assert np.allclose(table["end_time"], 0.02)


def test_the_check_finds_what_is_wrong(tmp_path, monkeypatch):
    monkeypatch.setattr("rbstab.sweep.check.SHARE", 7)
    plan = plan_of(20, base=quick(engine="heyoka"))
    ways = Ways(lambda plan: SingleRuns(plan, "scipy"), shard_size=8)
    check = sweep_to_folder(plan, tmp_path / "a", ways).check
    assert (len(check.members), check.unlike) == (3, 0)
    assert set(check.differences.values()) == {0.0}
    wrong = sweep_to_folder(plan, tmp_path / "b", Ways(FakeEngine)).check
    assert wrong.members == check.members
    assert wrong.unlike == 3  # the made up motion settles, and that of 0.02 s does not
    table = read_table(tmp_path / "b" / "sweep.h5")
    assert table.attributes["checked_members"] == 3
    assert table.attributes["checked_unlike"] == 3
    assert "lyapunov_end" in table["check_column"].tolist()


SWEEPER = """
import functools, sys
from pathlib import Path
from support.configs import FREE, plain
from support.sweeps import FakeEngine, plan_of
from rbstab.sweep.execute import ShardDone
from rbstab.sweep.sweep import Ways, sweep_to_folder
def told(event):
    if isinstance(event, ShardDone):
        print(event.number, flush=True)
factory = functools.partial(FakeEngine, delay=float(sys.argv[2]))
ways = Ways(factory=factory, shard_size=50, threads=2)
sweep_to_folder(plan_of(1500), Path(sys.argv[1]), ways, told)
"""


def sweeper(path, delay=3e-4):
    return subprocess.Popen(
        [sys.executable, "-c", SWEEPER, str(path), str(delay)],
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[1],
    )


def kill_until_done(path, instants):
    """Kills the sweep at instants (s after its first shard) and lets it end at last."""
    for instant in instants:
        with sweeper(path) as process:
            if process.stdout.readline():
                time.sleep(instant)
            process.kill()
    with sweeper(path, 0) as process:
        assert process.wait() == 0


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="nothing is killed like that here")
def test_killed_at_random_instants(tmp_path):
    ways = {"shard_size": 50}
    swept(tmp_path / "a", plan_of(1500), **ways)
    instants = [random.Random(seed).uniform(0, 0.06) for seed in range(3)]  # noqa: S311
    kill_until_done(tmp_path / "b", instants)
    assert shard_files(tmp_path / "b") == shard_files(tmp_path / "a")
    assert digest_of(tmp_path / "b") == digest_of(tmp_path / "a")


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="nothing is killed like that here")
def test_killed_at_fifty_random_instants(tmp_path):
    swept(tmp_path / "a", plan_of(1500), shard_size=50)
    rng = random.Random(50)  # noqa: S311
    for sweep_number in range(10):
        path = tmp_path / str(sweep_number)
        kill_until_done(path, [rng.uniform(0, 0.08) for _ in range(5)])
        assert digest_of(path) == digest_of(tmp_path / "a")


def test_variants_and_axes_of_a_plan_in_its_file(tmp_path):
    path = Path(__file__).parents[2] / "configs" / "sweeps" / "variants.yaml"
    plan = load_plan(path, ["integration.engine=scipy"])
    done = swept(tmp_path / "a", plan, shard_size=1024)
    table = rbstab.open_sweep(done.folder.sweep_file)
    assert table.words("controller_variant")[[0, 1000, 4999]].tolist() == [
        "free",
        "permanent",
        "sliding",
    ]
    assert table["grid_axis"].tolist() == ["controller.variant", "point"]
    assert table.shaped("final_position").shape == (5, 1000, 3)
    assert table["run_id"][4321].decode() == run_id(plan.config_of(4321))
    ours = table.to_xarray()
    with xarray.open_dataset(done.folder.sweep_file, engine="h5netcdf") as data:
        assert data["initial_position_2"].attrs == {
            "units": "m",
            "long_name": "initial.position[2]",
        }
        assert data["controller_variant"].attrs["flag_meanings"].split() == list(plan.variants)
        assert set(ours.variables) >= set(data.variables) - {"grid_axis_number"}
        for name in ("initial_position_2", "final_position", "status", "grid_length"):
            assert (ours[name].values == data[name].values).all()


def test_every_key_that_varies_has_a_unit():
    """In the ready plans, and as a factor none."""
    for path in (Path(__file__).parents[2] / "configs" / "sweeps").glob("*.yaml"):
        plan = load_plan(path)
        for name, column in varied_layout(plan).items():
            assert column.unit, name
            assert name.isidentifier()
