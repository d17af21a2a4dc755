"""Protects JSON documents with a digest: numbers come back exactly, and damage is noticed."""

from typing import Any

import pytest

from rbstab.store.document import read_document, write_document
from rbstab.store.errors import NotAResultError, StoreError

DATA: dict[str, Any] = {
    "numbers": [0.1, 1e-300, -0.0, 5e-324, 1 / 3],
    "text": "θ2 = -π/2",
    "nothing": None,
}


def test_numbers_and_texts_come_back_to_the_last_digit(tmp_path):
    path = tmp_path / "new" / "a.json"
    write_document(path, DATA)
    found = read_document(path)
    assert found == DATA
    assert [x.hex() for x in found["numbers"]] == [x.hex() for x in DATA["numbers"]]
    assert [p.name for p in path.parent.iterdir()] == ["a.json"]
    assert DATA["text"] in path.read_text(encoding="utf-8")
    write_document(path, {"a": 2})
    assert read_document(path) == {"a": 2}


def test_any_changed_character_is_noticed(tmp_path):
    path = tmp_path / "a.json"
    # Without the smallest number: 5e-324 and 7e-324 are the same double.
    write_document(path, {**DATA, "numbers": [0.1, 1e-300, 1 / 3]})
    text = path.read_text()
    changed = 0
    for at in range(len(text)):
        if text[at] in " \n":
            continue
        path.write_text(text[:at] + ("7" if text[at] != "7" else "8") + text[at + 1 :])
        with pytest.raises(NotAResultError, match="is damaged"):
            read_document(path)
        changed += 1
    assert changed > 100


@pytest.mark.parametrize(
    "content", ["", "[]", "3", "{}", '{"digest": "no"}', "\x00", "[" * 100_000]
)
def test_what_is_no_document(tmp_path, content):
    path = tmp_path / "a.json"
    path.write_text(content)
    with pytest.raises(NotAResultError):
        read_document(path)


def test_bytes_that_are_no_text(tmp_path):
    path = tmp_path / "a.json"
    path.write_bytes(b"\xff\xfe\xfa")
    with pytest.raises(NotAResultError, match="is not a text file"):
        read_document(path)


def test_a_folder_that_cannot_be_made(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(StoreError, match="cannot be written"):
        write_document(tmp_path / "file" / "a.json", DATA)
    with pytest.raises(StoreError, match="cannot be read"):
        read_document(tmp_path / "nothing.json")


def test_a_number_that_is_none_is_refused_and_nothing_is_left(tmp_path):
    with pytest.raises(ValueError, match="JSON"):
        write_document(tmp_path / "a.json", {"a": float("nan")})
    assert list(tmp_path.iterdir()) == []
