"""Protects names of files as text: every byte that Python could not decode stays visible."""

import pytest

from rbstab.files.text import printable, readable_name


@pytest.mark.parametrize(
    ("raw", "shown"),
    [
        (b"plain.yaml", "plain.yaml"),
        ("größe/θ.yaml".encode(), "größe/θ.yaml"),
        (b"\xff.yaml", "\udcff.yaml"),
        ("é".encode() + b"\xff", "é\udcff"),
    ],
)
def test_bytes_of_utf_8_are_decoded(raw, shown):
    assert readable_name(raw.decode("ascii", "surrogateescape")) == shown


def test_other_texts_stay_as_they_are():
    for text in ("größe", "\ud800", "é\ud800\udcff", ""):
        assert readable_name(text) == text


def test_a_printed_name_is_readable_and_one_line():
    assert printable("größe\n".encode().decode("ascii", "surrogateescape")) == "größe\\n"
    assert printable("\udcff\ud800") == "\\udcff\\ud800"
