"""Protects tables: in a file and on a terminal nothing is cut."""

from io import StringIO

from rich.console import Console

from rbstab_cli.printing import Table, fits, plain_lines, records, rich_table, width_of


def test_a_narrow_terminal_cuts_no_number():
    """Nine columns of a run need more than 80 characters: each run then has a line for each."""
    names = (
        "v(0) [J]",
        "v(end) [J]",
        "|r|/largest energy",
        "at rest from [s]",
        "peak |E| [m]",
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


def test_what_fits_is_printed_whole():
    """A table that fits by its own count is not cut by rich."""
    names = ("a number [m]", "b [s]")
    table = Table(*names, numbers=names)
    table.add("0.0123456789", "1.0987")
    width = next(w for w in range(100) if fits(table, w))
    text = StringIO()
    Console(file=text, width=width).print(rich_table(table))
    assert "0.0123456789" in text.getvalue()
    assert "1.0987" in text.getvalue()


def test_a_file_has_every_character_in_columns_of_equal_width():
    """Numbers end where their header ends; nothing is cut, whatever its width on a terminal."""
    table = Table("name", "value [m]", "next", numbers=("value [m]",))
    for name in ("宽", "e\u0301", "x" * 2000):
        table.add(name, "1.5", "n")
    lines = plain_lines(table)
    assert lines[3].strip().startswith("x" * 2000)
    assert {width_of(line) for line in lines[1:]} == {2015}
    assert [line.index("1.5") + 3 for line in lines[1:3]] == [2011, 2013]
    assert lines[0].index("value [m]") + 9 == 2012
