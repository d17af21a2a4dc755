"""A file that is missing, too large or not text is refused with its place and the reason."""

import codecs

import pytest
from support.configs import VISCO_ELASTIC, edited

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config

MIB = 1 << 20


def refused(path):
    with pytest.raises(ConfigError) as caught:
        load_config(path)
    return str(caught.value)


def test_missing(tmp_path):
    path = tmp_path / "no.yaml"
    assert refused(path) == (
        f"{path}:1:1: cannot be read: No such file or directory (expected a YAML file; "
        "`rbstab init` writes a first one, `rbstab examples` lists others)"
    )
    assert refused(str(path)) == refused(path)
    assert "`rbstab init`" in refused(tmp_path / "no folder" / "no.yaml")


def test_directory(tmp_path):
    expected = f"{tmp_path}:1:1: cannot be read: Is a directory (expected a YAML file)"
    assert refused(tmp_path) == expected


def test_below_a_file(tmp_path):
    (tmp_path / "a").write_text("")
    path = tmp_path / "a" / "b.yaml"
    assert refused(path) == f"{path}:1:1: cannot be read: Not a directory (expected a YAML file)"


def test_name_too_long(tmp_path):
    assert "File name too long" in refused(tmp_path / ("x" * 300))


def test_largest_file(write):
    padding = "#" * (MIB - len(VISCO_ELASTIC) - 1) + "\n"
    path = write(VISCO_ELASTIC + padding)
    assert path.stat().st_size == MIB
    assert load_config(path).body.mass == 41.0
    path = write(VISCO_ELASTIC + "#" + padding)
    assert refused(path) == (
        f"{path}:1:1: cannot be read: it has more than {MIB} bytes (expected a YAML file)"
    )


def test_enormous_file(tmp_path):
    """The reader stops at the size limit: a sparse file of a terabyte fits into no memory."""
    path = tmp_path / "hole.yaml"
    with path.open("wb") as file:
        file.truncate(1 << 40)
    assert f"it has more than {MIB} bytes" in refused(path)


NOT_TEXT = [
    (b"title: Caf\xe9\n", "UTF-8 in line 1"),
    (b"a: 1\nb: 2\nccc: \x80\n", "UTF-8 in line 3"),
    (b"a: 1\r\n\xc3", "UTF-8 in line 2"),
    (b"a: \xed\xa0\x80\n", "UTF-8 in line 1"),
    (b"\xef\xbb\xbfa: 1\n\xff: 1\n", "UTF-8 in line 2"),
    ("a: 1\nb: \u00e9".encode("utf-16") + b"\x00", "UTF-16 in line 2"),
]


@pytest.mark.parametrize(("raw", "place"), NOT_TEXT)
def test_not_text(complaints, raw, place):
    expected = f"1:1: cannot be read: it is not text in {place} (expected a YAML file)"
    assert complaints(raw) == [expected]


def test_a_result_is_no_config(complaints):
    (message,) = complaints(b"\x89HDF\r\n\x1a\n" + b"\0" * 100)
    assert "it is an HDF5 file, as results are: `rbstab show` prints it" in message


def test_byte_order_mark(load, complaints):
    """Editors on Windows write a byte order mark; columns are counted behind it."""
    mark = b"\xef\xbb\xbf"
    assert load(mark + VISCO_ELASTIC.encode()).title == "Case"
    found = complaints(mark + edited("title:", "titel:").encode())
    assert found == ["1:1: titel: is unknown (did you mean title?)"]
    found = complaints(mark + b"{title: 5, " + b"x: 1}\n")
    assert "1:9: title: is 5 (expected a text)" in found


@pytest.mark.parametrize("mark", [codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE])
def test_utf_16(load, complaints, mark):
    """PowerShell writes what a command prints in UTF-16."""
    encoding = "utf-16-le" if mark == codecs.BOM_UTF16_LE else "utf-16-be"
    text = edited("title: Case", "title: Über θ").replace("\n", "\r\n")
    assert load(mark + text.encode(encoding)).title == "Über θ"
    found = complaints(mark + edited("title:", "titel:").encode(encoding))
    assert found == ["1:1: titel: is unknown (did you mean title?)"]


@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_line_ends(load, complaints, line_end):
    assert load(VISCO_ELASTIC.replace("\n", line_end)).body.mass == 41.0
    text = edited("mass: 41.0", "mass: -1").replace("\n", line_end)
    assert complaints(text) == ["3:9: body.mass: is -1 (expected a number greater than 0)"]


def test_columns_count_characters(complaints):
    """Columns count characters, as editors do: not bytes, not halves of a surrogate pair."""
    found = complaints("{title: é😀é, zzz: 1}\n")
    assert any(message.startswith("1:14: zzz: is unknown") for message in found)


FORBIDDEN = [
    ("title: Ca\x1bse\n", "1:10:"),
    ("title: Case\n\x07\n", "2:1:"),
    ("\x7f", "1:1:"),
    ('title: "\u00e9\u00e9\0"\n', "1:11:"),
]


@pytest.mark.parametrize(("text", "place"), FORBIDDEN)
def test_control_characters(complaints, text, place):
    assert complaints(text) == [f"{place} has a character that YAML forbids (expected text)"]


def test_path_with_a_null_byte():
    assert "cannot be read" in refused("a\0b.yaml")
