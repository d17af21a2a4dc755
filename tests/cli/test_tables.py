"""Protects the tables off a terminal: the lines made here are those that the library rich makes."""

from random import Random

import pytest

from rbstab_cli.output import tables
from rbstab_cli.output.tables import FILE_WIDTH, Table, add_row, new_table, print_table

NARROW = "abc XYZ0-9./_θΩé²ü°κ→|[]*"


def random_table(random: Random, characters: str) -> Table:
    """Return a table with up to six columns and four rows."""
    columns = tuple(f"c{k}" + random.choice(["", " [m]"]) for k in range(random.randint(1, 6)))
    words, numbers = (tuple(c for c in columns if random.random() < 0.4) for _ in range(2))
    table = new_table(*columns, words=words, numbers=numbers)
    for _ in range(random.randint(0, 4)):
        texts = ("".join(random.choices(characters, k=random.randint(0, 14))) for _ in columns)
        add_row(table, *texts, style=random.choice([None, "red"]))
    return table


@pytest.mark.parametrize("seed", range(40))
def test_the_lines_are_those_of_rich(
    seed: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    table = random_table(Random(seed), NARROW)  # noqa: S311 (texts of a test)
    print_table(table)
    plain = capsys.readouterr().out
    monkeypatch.setattr(tables, "_plain_lines", lambda _table: None)
    print_table(table)
    assert plain == capsys.readouterr().out


@pytest.mark.parametrize("cell", ["宽", "e\u0301", "x" * FILE_WIDTH])
def test_what_needs_more_than_padding_is_left_to_rich(
    cell: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    called = []
    by_rich = tables._rich_lines

    def record(table: Table) -> list[str]:
        called.append(table)
        return by_rich(table)

    monkeypatch.setattr(tables, "_rich_lines", record)
    table = new_table("a", "b")
    add_row(table, cell, "1")
    print_table(table)
    assert called == [table]
    assert cell[:900] in capsys.readouterr().out
