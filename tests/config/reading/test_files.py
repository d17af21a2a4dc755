"""A file that is missing, special, too large or not text is refused with its place and reason."""

import codecs
import os
import socket
import sys
from pathlib import Path

import pytest
from support.configs import VISCO_ELASTIC, edited
from support.hang_guard import time_limit

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config

MIB = 1 << 20

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="no such files there")


def reason(path):
    """Return why a file is refused, which must be said without waiting for it."""
    with time_limit(30), pytest.raises(ConfigError) as caught:
        load_config(path)
    begin = f"{str(path).encode('unicode_escape').decode()}:1:1: cannot be read: "
    assert str(caught.value).startswith(begin)
    return str(caught.value).removeprefix(begin).removesuffix(" (expected a YAML file)")


def test_missing(tmp_path):
    expected = (
        "No such file or directory (expected a YAML file; `rbstab init` writes a first one, "
        "`rbstab examples` lists others)"
    )
    assert reason(tmp_path / "no.yaml") == reason(str(tmp_path / "no/no.yaml")) == expected


def test_what_is_no_file(tmp_path):
    (tmp_path / "a").write_text("")
    assert reason(tmp_path) == "Is a directory"
    assert reason(tmp_path / "a" / "b.yaml") == "Not a directory"
    assert reason(tmp_path / ("x" * 300)) == "File name too long"
    assert "null" in reason("a\0b.yaml")


@POSIX
def test_pipes_and_devices(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    Path("link").symlink_to("pipe")
    assert reason("pipe") == reason("link") == "it is a pipe, not a file"
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind("socket")
        for path in ("/dev/zero", "/dev/null", "socket"):
            assert reason(path) == "it is a device or a socket, not a file"
    Path("case.yaml").write_text(VISCO_ELASTIC)
    Path("good").symlink_to("case.yaml")
    assert load_config("good").body.mass == 41.0


def test_the_largest_file(write, tmp_path):
    padding = "#" * (MIB - len(VISCO_ELASTIC) - 1) + "\n"
    path = write(VISCO_ELASTIC + padding)
    assert path.stat().st_size == MIB
    assert load_config(path).body.mass == 41.0
    too_large = f"it has more than {MIB} bytes"
    assert reason(write(VISCO_ELASTIC + "#" + padding)) == too_large
    # The reader stops at the limit: a sparse file of a terabyte fits into no memory.
    with (tmp_path / "hole.yaml").open("wb") as file:
        file.truncate(1 << 40)
    assert reason(tmp_path / "hole.yaml") == too_large


NOT_TEXT = [
    (b"title: Caf\xe9\n", "it is not text in UTF-8 in line 1"),
    (b"a: 1\nb: 2\nccc: \x80\n", "it is not text in UTF-8 in line 3"),
    (b"a: 1\r\n\xc3", "it is not text in UTF-8 in line 2"),
    (b"a: \xed\xa0\x80\n", "it is not text in UTF-8 in line 1"),
    (b"\xef\xbb\xbfa: 1\n\xff: 1\n", "it is not text in UTF-8 in line 2"),
    ("a: 1\nb: \u00e9".encode("utf-16") + b"\x00", "it is not text in UTF-16 in line 2"),
    (
        b"\x89HDF\r\n\x1a\n" + b"\0" * 100,
        "it is an HDF5 file, as results are: `rbstab show` prints it",
    ),
]


@pytest.mark.parametrize(("raw", "expected"), NOT_TEXT)
def test_what_is_no_text(write, raw, expected):
    assert reason(write(raw)).startswith(expected)


@pytest.mark.parametrize(
    ("mark", "encoding"),
    [
        (codecs.BOM_UTF8, "utf-8"),  # editors on Windows
        (codecs.BOM_UTF16_LE, "utf-16-le"),  # PowerShell
        (codecs.BOM_UTF16_BE, "utf-16-be"),
    ],
)
@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_byte_order_marks_and_line_ends(load, complaints, mark, encoding, line_end):
    """Lines and columns are counted behind the mark, and are those of an editor."""

    def raw(old, new):
        return mark + edited(old, new).replace("\n", line_end).encode(encoding)

    assert load(raw("Case", "Über θ")).title == "Über θ"
    messages = complaints(raw("title:", "titel:"))
    assert messages == ["1:1: titel: is unknown (did you mean title?)"]
    assert complaints(raw("41.0", "-1"))[0].startswith("3:9: body.mass: is -1 ")


def test_columns_count_characters(complaints):
    """Columns count characters, as editors do: not bytes, not halves of a surrogate pair."""
    messages = complaints("{title: é😀é, zzz: 1}\n")
    assert any(message.startswith("1:14: zzz: is unknown") for message in messages)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("title: Ca\x1bse\n", "1:10:"),
        ("title: Case\n\x07\n", "2:1:"),
        ("\x7f", "1:1:"),
        ('title: "\u00e9\u00e9\0"\n', "1:11:"),
    ],
)
def test_control_characters(complaints, text, place):
    assert complaints(text) == [f"{place} has a character that YAML forbids (expected text)"]


UNKNOWN = [f"k{number:05d}: 1" for number in range(90_000)]


@pytest.mark.parametrize(
    ("text", "last"),
    [
        (VISCO_ELASTIC + "\n".join(UNKNOWN[:900]), "119:1: 801 more problems are not listed"),
        ("\n".join(UNKNOWN), "at least 901 more problems are not listed"),
        (edited("[10.0, 8.0, 0.4]", f"[{'a,' * 100_000}]"), "at least 901 more problems are not"),
        (VISCO_ELASTIC + "a: [" + "[]," * 100_000 + "]\n", "20:1: a: is unknown"),
        ("[" * 100_000, "nest"),
        ("{a: " * 100_000, "nest"),
        ("- " * 100_000, "nest"),
        (edited("Case", "x" * 1_000_000), "1:8: title: has 1000000 characters (expected at most"),
        (edited("visco-elastic", "x" * 1_000_000), "7:12: controller.variant: is the text"),
    ],
    ids=lambda text: text[:40],
)
def test_a_large_file_is_refused_after_little_work(complaints, text, last):
    messages = complaints(text)
    assert last in messages[-1]
    assert len(messages) <= 100
    assert all(len(message) < 300 for message in messages)
