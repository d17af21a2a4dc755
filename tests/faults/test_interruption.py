"""Ctrl-C, a full disk or a taken file name never leave a partial, lost or wrong result."""

import errno
import os

import pytest
from support.configs import VISCO_ELASTIC, plain
from support.problems import each_engine

from rbstab.config.load import load_config
from rbstab.experiment.run_to_file import run_to_file
from rbstab.experiment.simulate import simulate
from rbstab.store.errors import ResultExistsError, StoreError
from rbstab.store.result import open_result

SHORT = ("integration.duration=0.05", "integration.samples=3", "integration.rtol=1e-9")


def config_of(engine="scipy", *changes, text=VISCO_ELASTIC):
    return load_config(plain(text), [*SHORT, f"integration.engine={engine}", *changes])


class Interrupted:
    """A progress callback that raises KeyboardInterrupt after some calls, as Ctrl-C does."""

    def __init__(self, calls, error=KeyboardInterrupt):
        self.calls = calls
        self.error = error
        self.times = []

    def __call__(self, t):
        self.times.append(t)
        if len(self.times) == self.calls:
            raise self.error


@each_engine
@pytest.mark.parametrize("calls", [1, 3])
@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, ZeroDivisionError])
def test_an_interrupted_run_leaves_no_file(tmp_path, engine, calls, error):
    progress = Interrupted(calls, error)
    with pytest.raises(error):
        run_to_file(config_of(engine), tmp_path / "a.h5", progress=progress)
    assert len(progress.times) == calls
    assert 0 < progress.times[-1] < 0.05
    assert list(tmp_path.iterdir()) == []


@each_engine
def test_an_interrupted_run_leaves_the_engine_in_order(engine):
    """heyoka's integrator is reused: the next run must not continue the interrupted one."""
    expected = simulate(config_of(engine))
    with pytest.raises(KeyboardInterrupt):
        simulate(config_of(engine), progress=Interrupted(2))
    again = simulate(config_of(engine))
    for name in expected.variables:
        # Compared as texts, because NaN does not equal itself.
        assert str(again[name].tolist()) == str(expected[name].tolist()), name


def test_an_interrupted_repetition_keeps_the_old_result(tmp_path):
    path = tmp_path / "a.h5"
    run_to_file(config_of(), path)
    before = path.read_bytes()
    with pytest.raises(KeyboardInterrupt):
        run_to_file(config_of(), path, force=True, progress=Interrupted(1))
    other = config_of("scipy", "body.mass=50")
    with pytest.raises(KeyboardInterrupt):
        run_to_file(other, path, force=True, progress=Interrupted(1))
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_does_not_lose_a_different_result(tmp_path, monkeypatch):
    """The old result is moved aside first, and stays there if the new one cannot be written."""
    path = tmp_path / "a.h5"
    old = run_to_file(config_of(), path).result
    fsync = os.fsync

    def full(descriptor):
        if os.fstat(descriptor).st_size > 10_000:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(StoreError, match="No space left"):
        run_to_file(config_of("scipy", "body.mass=50"), path, force=True)
    (left,) = tmp_path.iterdir()
    assert open_result(left).run_id == old.run_id


def test_a_name_that_was_taken_while_the_run_went_on(tmp_path):
    """If two runs use one name, the one that ends last does not overwrite the other."""
    path = tmp_path / "a.h5"

    class Overtaken(Interrupted):
        def __call__(self, t):
            super().__call__(t)
            if len(self.times) == 1:
                run_to_file(config_of("scipy", "body.mass=50"), path)

    with pytest.raises(ResultExistsError):
        run_to_file(config_of(), path, progress=Overtaken(0))
    assert open_result(path).config.count("mass: 50.0") == 1
    assert list(tmp_path.iterdir()) == [path]


def test_a_damaged_result_is_neither_trusted_nor_overwritten(tmp_path):
    path = tmp_path / "a.h5"
    run_to_file(config_of(), path)
    content = path.read_bytes()[:5000]
    path.write_bytes(content)
    with pytest.raises(ResultExistsError, match="damaged"):
        run_to_file(config_of(), path)
    assert path.read_bytes() == content
    filed = run_to_file(config_of(), path, force=True)
    assert filed.moved_aside is not None
    assert filed.moved_aside.read_bytes() == content
    assert open_result(path).status == "completed"
