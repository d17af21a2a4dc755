"""Protects the reading of many results: one process and several processes give the same."""

import os
import shutil

import psutil
import pytest

from rbstab.report.model.document import Unread
from rbstab.report.reading import read_results as reading
from rbstab.report.reading.read_results import ReadRun, read_all, read_one

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    """Sixty files: copies of two results, and three files that are no result."""
    from rbstab.config.load import load_config
    from rbstab.experiment.simulate import simulate
    from rbstab.store.run_file import write_result

    folder = tmp_path_factory.mktemp("many")
    found = []
    for mass in (40.0, 41.0):
        changes = [f"body.mass={mass}", "integration.duration=0.05", "integration.samples=3"]
        config = load_config("configs/paper/case1_permanent.yaml", changes)
        write_result(folder / f"{mass}.h5", simulate(config))
    for number in range(60):
        path = folder / f"{number:02d}.h5"
        if number % 20 == 7:
            path.write_text("no result")
        else:
            shutil.copy(folder / f"{40.0 + number % 2}.h5", path)
        found.append(path)
    return found


def summary(found):
    """Return the reason of each unread file, and the name and run id of each run."""
    return [
        one.reason if isinstance(one, Unread) else (one.file.name, one.result.run_id)
        for one in found
    ]


@pytest.fixture
def two_processes(monkeypatch):
    """Make two processes read even a few files."""
    monkeypatch.setattr(reading, "MIN_FOR_PROCESSES", 10)
    monkeypatch.setattr(reading, "CHUNK_SIZE", 5)
    monkeypatch.setattr(reading, "processor_count", lambda: 2)


def test_several_processes_read_what_one_reads_in_the_same_order(paths, two_processes):
    alone = summary(map(read_one, paths))
    assert summary(read_all(paths)) == alone
    assert [isinstance(one, str) for one in alone] == [n % 20 == 7 for n in range(60)]
    assert len({run_id for one in alone if not isinstance(one, str) for run_id in one[1:]}) == 2


def test_what_a_process_that_dies_has_not_read_is_read_here(paths, two_processes):
    results = read_all(paths)
    found = [next(results)]
    for child in psutil.Process().children(recursive=True):
        if "popen_loky" in " ".join(child.cmdline()):
            child.kill()
    found += results
    assert summary(found) == summary(map(read_one, paths))
    assert isinstance(found[0], ReadRun)


def test_few_are_read_here(paths, monkeypatch):
    monkeypatch.setattr(reading, "processor_count", lambda: 2)
    before = {child.pid for child in psutil.Process(os.getpid()).children(recursive=True)}
    assert len(list(read_all(paths[:5]))) == 5
    after = {child.pid for child in psutil.Process(os.getpid()).children(recursive=True)}
    assert after <= before
