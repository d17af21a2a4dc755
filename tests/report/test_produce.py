"""Protects the report from single results whose content raises errors: the others are reported."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_runs import made_result
from support.made_sweeps import GRID, write_sweep

from rbstab.report.model.document import Report
from rbstab.report.produce import produce
from rbstab.report.reading.sources import read_sources
from rbstab.report.writers.write import write_report
from rbstab.store.errors import StoreError
from rbstab.store.result import write_result


def with_array(result, name, value):
    variable = result.variables[name]
    data = np.full_like(variable.data, value)
    return replace(result, variables={**result.variables, name: variable._replace(data=data)})


@pytest.fixture
def files(tmp_path):
    """A good run, and one whose orientation is infinite; both have right digests."""
    good, wrong = tmp_path / "good.h5", tmp_path / "wrong.h5"
    write_result(good, made_result())
    write_result(wrong, with_array(made_result(), "orientation", np.inf))
    return good, wrong


def produced(paths, folder, form="text"):
    """Produce a report in a file, and return the sources and the report."""
    reports = []

    def write(report):
        write_report(report, folder / "report", form, force=True)
        reports.append(report)

    sources = produce(read_sources(paths), "a command", None, form, write)
    return sources, reports


@pytest.mark.parametrize(
    "form",
    ["text", *(pytest.param(form, marks=pytest.mark.slow) for form in ("html", "md", "pdf"))],
)
def test_one_wrong_result_does_not_take_the_report(files, tmp_path, form):
    sources, [report] = produced(files, tmp_path, form)
    assert [run.path.name for run in sources.runs] == ["good.h5"]
    [unread] = sources.unread
    assert unread.path.endswith("wrong.h5")
    assert "no finite state" in unread.reason
    assert report.unread == sources.unread
    assert (tmp_path / "report").is_file()


def test_no_report_of_wrong_results_only(files, tmp_path):
    sources, reports = produced(files[1:], tmp_path)
    assert (sources.runs, sources.sweeps, reports) == ((), (), [])
    assert len(sources.unread) == 1


def test_wrong_sweep_beside_a_run(files, tmp_path):
    sweep = write_sweep(tmp_path / "swept" / "members.h5", GRID)
    sources = read_sources([files[0], sweep.path])
    assert len(sources.sweeps) == 1
    # After it was read, another program wrote something else to the file.
    sweep.path.write_bytes(b"something else")
    written: list[object] = []
    reported = produce(sources, "a command", None, "text", written.append)
    assert (len(reported.runs), len(reported.sweeps), len(written)) == (1, 0, 1)
    assert "members.h5" in reported.unread[0].path


def test_error_of_a_writer_shows_the_result_that_causes_it(files, tmp_path, monkeypatch):
    other = tmp_path / "zebra.h5"
    write_result(other, made_result(title="zebra"))
    sources, original = read_sources([files[0], other]), write_report

    def fail_for_other(report, *arguments, **options):
        if any("zebra" in str(section) for section in report.sections):
            raise ZeroDivisionError("cannot be drawn")
        original(report, *arguments, **options)

    monkeypatch.setattr("rbstab.report.produce.write_report", fail_for_other)
    written: list[object] = []

    def write(report):
        fail_for_other(report, tmp_path / "report", "html", force=True)
        written.append(report)

    reported = produce(sources, "a command", None, "html", write)
    assert [run.path.name for run in reported.runs] == ["good.h5"]
    assert "cannot be drawn" in reported.unread[0].reason
    assert len(written) == 1


@pytest.mark.parametrize(
    "error", [StoreError("no space"), OSError(28, "no space"), ZeroDivisionError("a bug")]
)
def test_error_without_a_wrong_result_is_raised(files, error):
    def write(_):
        if isinstance(error, StoreError):
            raise error from OSError(28, "no space")
        raise error

    with pytest.raises(type(error)):
        produce(read_sources(files[:1]), "a command", None, "text", write)


@pytest.mark.parametrize(
    ("created", "made"),
    [
        ("2026-11-23T21:20:24+00:00", "2026-11-23 21:20 UTC"),
        ("2026-01-02T03:04:05", "2026-01-02 03:04"),
    ],
)
def test_when_a_report_was_made_is_readable(created, made):
    assert Report("", created, "", ()).made == made
