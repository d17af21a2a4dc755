"""Protects tables: off a terminal the lines are those of rich; on a terminal nothing is cut."""

from io import StringIO
from random import Random

import pytest
from rich.console import Console

from rbstab_cli.output import tables
from rbstab_cli.output.tables import (
    FILE_WIDTH,
    Table,
    fits,
    records,
)

NARROW = "abc XYZ0-9./_θΩé²ü°κ→|[]*"


def random_table(random: Random, characters: str) -> Table:
    """Return a table with up to six columns and four rows."""
    columns = tuple(f"c{k}" + random.choice(["", " [m]"]) for k in range(random.randint(1, 6)))
    words, numbers = (tuple(c for c in columns if random.random() < 0.4) for _ in range(2))
    table = Table(*columns, words=words, numbers=numbers)
    for _ in range(random.randint(0, 4)):
        texts = ("".join(random.choices(characters, k=random.randint(0, 14))) for _ in columns)
        table.add(*texts, style=random.choice([None, "red"]))
    return table


@pytest.mark.parametrize("seed", range(40))
def test_the_lines_are_those_of_rich(
    seed: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    table = random_table(Random(seed), NARROW)  # noqa: S311 (texts of a test)
    table.print()
    plain = capsys.readouterr().out
    monkeypatch.setattr(tables, "_plain_lines", lambda _table: None)
    table.print()
    assert plain == capsys.readouterr().out


def test_a_narrow_terminal_cuts_no_number() -> None:
    """Nine columns of a run need more than 80 characters: each run then has a line for each."""
    names = (
        "v(0) [J]",
        "v(end) [J]",
        "|r|/largest energy",
        "at rest from [s]",
        "max|E| [m]",
        "time [s]",
    )
    table = Table("file", "status", *names, words=("status",), numbers=names)
    for k in range(2):
        table.add(f"results/case{k}.h5", "completed", *(f"0.0{k}{n}681" for n in range(6)))
    assert fits(table, 120)
    assert not fits(table, 60)
    for k, record in enumerate(records(table)):
        assert fits(record, 60)
        assert record.columns == ("file", f"results/case{k}.h5")
        assert [row for row, _ in record.rows] == [
            ("status", "completed"),
            *((name, f"0.0{k}{n}681") for n, name in enumerate(names)),
        ]


def test_what_fits_is_printed_whole() -> None:
    """A table that fits by its own count is not cut by rich."""
    names = ("a number [m]", "b [s]")
    table = Table(*names, numbers=names)
    table.add("0.0123456789", "1.0987")
    width = next(w for w in range(100) if fits(table, w))
    text = StringIO()
    Console(file=text, width=width).print(tables._rich_table(table, on_terminal=True))
    assert "0.0123456789" in text.getvalue()
    assert "1.0987" in text.getvalue()


@pytest.mark.parametrize("cell", ["宽", "e\u0301", "x" * FILE_WIDTH])
def test_what_needs_more_than_padding_is_left_to_rich(
    cell: str, capsys: pytest.CaptureFixture[str]
) -> None:
    table = Table("a", "b")
    table.add(cell, "1")
    assert tables._plain_lines(table) is None
    table.print()
    assert cell[:900] in capsys.readouterr().out
