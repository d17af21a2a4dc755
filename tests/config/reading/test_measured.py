"""A measured motion is read in its units, and all that is wrong with its file is said at once."""

import math

import numpy as np
import pytest

from rbstab.config.errors import ConfigError
from rbstab.config.files.measured import read_measured


@pytest.fixture
def file(tmp_path, monkeypatch):
    """A function that writes a file `m.csv` in the working folder."""
    monkeypatch.chdir(tmp_path)

    def write(text, encoding="utf-8"):
        (tmp_path / "m.csv").write_bytes(text.encode(encoding))
        return "m.csv"

    return write


def problems(path, duration=math.inf):
    with pytest.raises(ConfigError) as raised:
        read_measured(path, duration)
    return str(raised.value).splitlines()


def test_numbers_become_si_and_empty_cells_are_gaps(file):
    text = (
        "# a motion\ntime [s], theta1 [deg] ,omega3 [deg/s],x2 [mm],e3 [cm],theta2 [rad]"
        "\n\n0,180,90,1500,3,0.5\r\n 0.5 ,,-360,NaN,,\n,,,,,\n"
    )
    for encoding in ("utf-8", "utf-8-sig", "utf-16"):
        measured = read_measured(file(text, encoding), 0.5)
        assert [
            (column.name, column.vector, column.axis, column.unit) for column in measured.columns
        ] == [
            ("theta1", "Theta", 0, "rad"),
            ("omega3", "Omega", 2, "rad/s"),
            ("x2", "X", 1, "m"),
            ("e3", "E", 2, "m"),
            ("theta2", "Theta", 1, "rad"),
        ]
        assert measured.times.tolist() == [0.0, 0.5]
        first = [math.pi, math.pi / 2, 1.5, 0.03, 0.5]
        np.testing.assert_allclose(measured.values[0], first, rtol=1e-15)
        np.testing.assert_array_equal(np.isnan(measured.values[1]), [True, False, True, True, True])
        assert measured.values[1, 1] == pytest.approx(-2 * math.pi)


def test_all_problems_are_told_each_with_its_line_and_column(file):
    text = (
        "time [s],theta1 [grad],x1 [mm],x1 [m],q\n0,1,2,,3\n0.1,1\n# a comment\n"
        "0.2,a,nan,  1e400,1_0\nx,1,2,3,4\n0.2,,,,\n9,,,,\n10,,,,\n-1,,,,"
    )
    ends = [
        "1:10: is 'theta1 [grad]' (expected such as theta1 [deg], omega1 [rad/s], x1 [mm] "
        "or e1 [m], with 1 to 3, each once)",
        # The same in another unit is not the same head.
        "1:32: is 'x1 [m]' (expected such as theta1 [deg]",
        "1:39: is 'q' (expected such as theta1 [deg]",
        "3:1: has 2 cells (expected 5)",
        "5:5: is 'a' (expected a finite number; a gap is empty)",
        "5:13: is '1e400' (expected a finite number; a gap is empty)",
        "5:19: is '1_0' (expected a finite number; a gap is empty)",
        "6:1: is 'x' (expected a finite number; a gap is empty)",
        "7:1: is the time 0.2 s (expected rising times from 0 to 5 s, the end of the run)",
        "8:1: is the time 9 s (expected rising times",
        # A motion that is longer than the run is one problem.
        "10:1: is the time -1 s (expected rising times",
    ]
    lines = problems(file(text), 5.0)
    assert len(lines) == len(ends)
    for line, end in zip(lines, ends, strict=True):
        assert line.startswith(f"m.csv:{end}")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "m.csv:1:1: is '' (expected time [s], then a comma and other columns)"),
        ("0,1\n1,2\n", "m.csv:1:1: is '0' (expected time [s], then a comma and other columns)"),
        (
            "time [s]\n0\n",
            "m.csv:1:1: is 'time [s]' (expected time [s], then a comma and other columns)",
        ),
        ("time [ms],x1 [m]\n0,1\n", "m.csv:1:1: is 'time [ms]' (expected time [s], then a"),
    ],
)
def test_a_file_of_another_kind_is_refused(file, text, problem):
    assert problems(file(text))[0].startswith(problem)


def test_a_file_that_cannot_be_read_is_told(file):
    assert problems("none.csv") == [
        "none.csv:1:1: cannot be read: No such file or directory (expected a CSV file)"
    ]
    (line,) = problems(file("\x89HDF\r\n\x1a\n", "latin-1"))
    assert "is an HDF5 file" in line
