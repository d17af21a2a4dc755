"""Protects the reading of many results: workers give what this process gives."""

import shutil

import psutil
import pytest

from rbstab.experiment.answers import assessed_run
from rbstab.experiment.answers.run_answer import answer_of
from rbstab.processes import mapped
from rbstab.report.model.document import Unread
from rbstab.report.reading.sources import Run, read_path

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    """Sixty files: copies of two results, and three files that are no result."""
    from rbstab.config.load import load_config
    from rbstab.experiment.simulate import simulate
    from rbstab.store.result import write_result

    folder = tmp_path_factory.mktemp("many")
    files = []
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
        files.append(path)
    return files


def summary(sources):
    """Return the reason of each unread file, and the name and run id of each run."""
    return [
        source.reason if isinstance(source, Unread) else (source.path.name, source.result.run_id)
        for source in sources
    ]


@pytest.fixture
def two_workers(monkeypatch):
    """Make two workers read even a few files."""
    monkeypatch.setattr(mapped, "PER_WORKER", 10)
    monkeypatch.setattr(mapped, "processor_count", lambda: 2)


def workers():
    children = psutil.Process().children(recursive=True)
    return {child for child in children if "popen_loky" in " ".join(child.cmdline())}


@pytest.mark.usefixtures("two_workers")
def test_workers_read_what_this_process_reads_in_the_same_order(paths):
    alone = summary(map(read_path, paths))
    results = mapped.mapped(read_path, paths)
    first = next(results)
    assert len(workers()) >= 2
    assert summary([first, *results]) == alone
    assert [isinstance(entry, str) for entry in alone] == [n % 20 == 7 for n in range(60)]
    assert (
        len({run_id for entry in alone if not isinstance(entry, str) for run_id in entry[1:]}) == 2
    )


@pytest.mark.usefixtures("two_workers")
def test_no_file_is_lost_with_a_worker_that_is_killed(paths):
    results = mapped.mapped(read_path, paths)
    read, killed = [next(results)], workers()
    assert killed
    for child in killed:
        child.kill()
    read += results
    assert summary(read) == summary(map(read_path, paths))


def test_answers_that_cannot_be_given_are_left_to_the_report(paths, monkeypatch):
    run = read_path(paths[0])
    assert isinstance(run, Run)
    # As text, because numbers that are none are not equal to themselves.
    assert repr(vars(run)["answer"]) == repr(answer_of(run.result, run.config))

    def fails(*_):
        raise ValueError("no answer")

    monkeypatch.setattr(assessed_run, "answer_of", fails)
    without = vars(read_path(paths[0]))
    assert "summary" in without
    assert "answer" not in without
