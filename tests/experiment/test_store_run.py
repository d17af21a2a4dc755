"""Storing a result beside other processes: a better result of the same config is never lost."""

import os
import sys
import threading
from dataclasses import replace

import numpy as np
import pytest
from support import results
from support.configs import plain

from rbstab.config.load import load_config
from rbstab.experiment import run_to_file as module
from rbstab.experiment.run_to_file import run_to_file
from rbstab.experiment.simulate import simulate
from rbstab.experiment.store_run import depends_on_machine, store_run
from rbstab.store.errors import ResultExistsError, StoreError
from rbstab.store.result import open_result, write_result

CONFIG = load_config(plain(), ["integration.duration=0.05", "integration.samples=6"])


@pytest.fixture(scope="module")
def whole():
    return simulate(CONFIG)


def cut(result, samples):
    """Return a result that hit its time limit after some samples."""
    short = results.cut(result, samples)
    return replace(short, attributes=result.attributes | {"status": "time limit"})


def store(path, result, **options):
    return store_run(path, result, lambda stored: not depends_on_machine(stored), **options)


def titled(result, title):
    return replace(result, attributes=result.attributes | {"title": title})


@pytest.mark.parametrize(
    ("first", "second", "options", "written"),
    [
        (2, 3, {}, True),
        (3, 3, {}, True),
        (3, 2, {}, False),
        # All samples, but the status says that the time was used up.
        (None, 6, {}, False),
        # A finished result of another process is kept.
        (None, None, {}, False),
        (None, None, {"force": True}, True),
    ],
)
def test_the_better_of_two_results_is_kept(  # noqa: PLR0917 (fixtures and one case)
    tmp_path, whole, first, second, options, written
):
    path = tmp_path / "a.h5"
    for title, samples in (("first", first), ("second", second)):
        result = whole if samples is None else cut(whole, samples)
        stored = store(path, titled(result, title), **(options if title == "second" else {}))
    assert (stored.computed, stored.moved_aside) == (written, None)
    assert open_result(path).attributes["title"] == ("second" if written else "first")
    assert stored.result.attributes["title"] == open_result(path).attributes["title"]
    assert list(tmp_path.iterdir()) == [path]


def test_force_moves_a_better_result_aside(tmp_path, whole):
    path = tmp_path / "a.h5"
    store(path, whole)
    before = path.read_bytes()
    stored = store(path, cut(whole, 2), force=True)
    assert stored.computed
    assert stored.moved_aside is not None
    assert stored.moved_aside.read_bytes() == before
    assert open_result(path).status == "time limit"


def test_a_different_result_is_refused_or_moved_aside(tmp_path, whole):
    path = tmp_path / "a.h5"
    other = replace(whole, attributes=whole.attributes | {"run_id": 32 * "0"})
    write_result(path, other)
    before = path.read_bytes()
    with pytest.raises(ResultExistsError, match=r"holds a different result \(run 00000000\)"):
        store(path, whole)
    assert path.read_bytes() == before
    stored = store(path, whole, force=True)
    assert stored.moved_aside == tmp_path / "a.00000000.h5"
    assert stored.moved_aside.read_bytes() == before
    assert open_result(path).run_id == whole.run_id


def test_an_error_of_moving_aside_is_said(tmp_path, whole, monkeypatch):
    path = tmp_path / "a.h5"
    path.write_bytes(b"not a result")

    def full(*_arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "link", full)
    monkeypatch.setattr("pathlib.Path.rename", full)
    with pytest.raises(StoreError, match=r"cannot be moved to .*: No space left on device"):
        store(path, whole, force=True)
    assert path.read_bytes() == b"not a result"


def test_an_unknown_trusted_time_depends_on_the_machine(whole):
    assert not depends_on_machine(whole)
    scalar = whole.variables["energy_at_rest"]._replace(data=np.array(np.nan))
    unknown = replace(whole, variables=whole.variables | {"trusted_until": scalar})
    assert depends_on_machine(unknown)
    finite = scalar._replace(data=np.array(0.5))
    assert not depends_on_machine(
        replace(whole, variables=whole.variables | {"trusted_until": finite})
    )


def overtaken_run(path, monkeypatch, result, other):
    """Run the config; another process stores its result while this run is integrated."""

    def simulate_problem(*_arguments, **_options):
        write_result(path, other, replace=True)
        return result

    monkeypatch.setattr(module, "simulate_problem", simulate_problem)
    return run_to_file(CONFIG, path)


@pytest.mark.parametrize("existed", [False, True])
def test_two_processes_that_repeat_a_time_limited_run_keep_the_longer_one(
    tmp_path, whole, monkeypatch, existed
):
    path = tmp_path / "a.h5"
    if existed:
        write_result(path, cut(whole, 2))
    filed = overtaken_run(path, monkeypatch, cut(whole, 3), cut(whole, 5))
    assert (filed.computed, filed.kept) == (False, True)
    assert len(filed.result["time"]) == len(open_result(path)["time"]) == 5
    filed = overtaken_run(path, monkeypatch, cut(whole, 4), cut(whole, 3))
    assert (filed.computed, filed.kept) == (True, False)
    assert len(open_result(path)["time"]) == 4
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows cannot lock folders")
def test_a_better_result_that_comes_between_reading_and_writing_is_not_lost(
    tmp_path, whole, monkeypatch
):
    """The other writer waits for the lock, and then finds the shorter result."""
    path = tmp_path / "a.h5"
    store(path, cut(whole, 2))
    other = threading.Thread(target=store, args=(path, cut(whole, 5)))

    def write_after_the_other(path, result, *, replace=False):
        monkeypatch.setattr("rbstab.experiment.store_run.write_result", write_result)
        other.start()
        # Without a lock the other writer would finish now.
        other.join(1.0)
        write_result(path, result, replace=replace)

    monkeypatch.setattr("rbstab.experiment.store_run.write_result", write_after_the_other)
    assert store(path, cut(whole, 3)).computed
    other.join(30.0)
    assert not other.is_alive()
    assert len(open_result(path)["time"]) == 5
    assert list(tmp_path.iterdir()) == [path]
