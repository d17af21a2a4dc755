"""`rbstab plot` writes single figures and their data, whole or not at all."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest
from cli.conftest import success
from support.made_runs import made_file

from rbstab.report.model.figure import Axis, Band, Cells, Figure, Panel, Points
from rbstab.report.writers.series import csv_of
from rbstab.store.result import open_result


@pytest.fixture
def run(folder):
    """The file of a run in the working folder."""
    return made_file(folder / "made.h5")


def test_the_figures_are_listed(run):
    done = success("plot", "made.h5")
    names = [line.split()[0] for line in done.stdout.splitlines()[1:] if line.strip()]
    assert "runs-decay" in names
    assert "run-1-energy" in names


@pytest.mark.parametrize(
    ("ending", "begin"), [("svg", b"<svg"), ("pdf", b"%PDF"), ("png", b"\x89PNG")]
)
def test_a_drawing_is_the_same_each_time(ending, begin, run):
    """But for the order in which a PDF lists its objects: vl-convert does not fix it."""
    for name in ("a", "b"):
        success("plot", "made.h5", "--figure", "runs-decay", "-o", f"{name}.{ending}")
    content = Path(f"a.{ending}").read_bytes()
    assert content.startswith(begin)
    again = Path(f"b.{ending}").read_bytes()
    assert content == again or (ending == "pdf" and len(content) == len(again))


def test_the_data_are_those_of_the_run(run):
    success("plot", "made.h5", "--figure", "runs-decay", "-o", "a.csv")
    with Path("a.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["panel"] == "1"]
    stored = open_result(run)
    assert [float(row["x"]) for row in rows] == stored["time"].tolist()
    assert [float(row["y"]) for row in rows] == stored["lyapunov"].tolist()
    assert {(row["x_axis"], row["y_axis"], row["series"]) for row in rows} == {
        ("time t [s]", "Lyapunov function v [J]", "made")
    }


def test_a_figure_for_one_column_of_a_paper(run):
    """It is 80 mm wide; its texts have 11 and 12 pixels of 1/96 inch: 8 and 9 points."""
    success("plot", "made.h5", "--figure", "runs-decay", "--column", "-o", "a.svg")
    content = Path("a.svg").read_text()
    (width,) = re.findall(r'^<svg [^>]*? width="([\d.]+)"', content)
    assert float(width) == pytest.approx(80 / 25.4 * 96, abs=0.01)
    assert set(re.findall(r'font-size="([\d.]+)px"', content)) == {"11", "12"}


def test_maps_bands_and_categories_have_their_values():
    x, y = np.array([1.0, 0.0]), np.array([3.0, 4.0])
    cells = Cells(x, y, np.array([[0.1, 0.2], [np.nan, 0.4]]), Axis("peak", "m"))
    band = Band(x, np.array([2.0, 3.0]), np.array([5.0, 7.0]), "between")
    points = Points(x, np.array([0.0, 4.0]), "ends")
    panels = (
        Panel(Axis("a"), Axis("b"), (cells,)),
        Panel(Axis("a"), Axis("b", categories=("good", "bad")), (band, points)),
    )
    assert csv_of(Figure("f", "F", panels)).splitlines()[1:] == [
        "1,a,b,peak [m],1.0,3.0,,,0.1",
        "1,a,b,peak [m],0.0,3.0,,,0.2",
        "1,a,b,peak [m],1.0,4.0,,,nan",
        "1,a,b,peak [m],0.0,4.0,,,0.4",
        "2,a,b,between,1.0,,2.0,5.0,",
        "2,a,b,between,0.0,,3.0,7.0,",
        "2,a,b,ends,1.0,good,,,",
        "2,a,b,ends,0.0,4.0,,,",
    ]
