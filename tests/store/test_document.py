"""Protects JSON documents with a digest: numbers come back exactly, and damage is noticed.

Too much data, odd numbers, and values of other types are refused.
"""

import hashlib
import json
from typing import Any

import pytest
from pydantic import BaseModel, ConfigDict

from rbstab.store import document
from rbstab.store.document import checked, read_document, read_model, write_document
from rbstab.store.errors import NotAResultError, StoreError

LARGEST = 16 << 20

DATA: dict[str, Any] = {
    "numbers": [0.1, 1e-300, -0.0, 5e-324, 1 / 3],
    "text": "θ2 = -π/2",
    "nothing": None,
}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.json"


def refusal(function, path, *arguments, kind=NotAResultError):
    """Return why a document is refused."""
    with pytest.raises(StoreError) as caught:
        function(path, *arguments)
    assert type(caught.value) is kind
    return str(caught.value).removeprefix(f"{path} ")


def test_numbers_and_texts_come_back_to_the_last_digit(tmp_path):
    path = tmp_path / "new" / "a.json"
    write_document(path, {"a": 2})
    write_document(path, DATA)
    # Other programs may write the keys in another order.
    data = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps(dict(reversed(data.items())), ensure_ascii=False), encoding="utf-8")
    stored = read_document(path)
    assert stored == DATA
    assert [x.hex() for x in stored["numbers"]] == [x.hex() for x in DATA["numbers"]]
    assert [p.name for p in path.parent.iterdir()] == ["a.json"]
    assert DATA["text"] in path.read_text(encoding="utf-8")


def test_any_changed_character_is_noticed(path):
    # Without the smallest number: 5e-324 and 7e-324 are the same double.
    write_document(path, {**DATA, "numbers": [0.1, 1e-300, 1 / 3]})
    text = path.read_text()
    places = [at for at, letter in enumerate(text) if letter not in " \n"]
    for at in places:
        path.write_text(text[:at] + ("7" if text[at] != "7" else "8") + text[at + 1 :])
        assert "is damaged" in refusal(read_document, path)
    assert len(places) > 100


def of_number(text, value):
    """Return a document with a number under its right digest."""
    digest = hashlib.sha256(json.dumps({"a": value}).encode()).hexdigest()
    return f'{{"a": {text}, "digest": "{digest}"}}'


INF = float("inf")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        *((x, "is damaged") for x in ("", "[]", "3", "{}", '{"digest": "no"}', "\0", "[" * 100000)),
        (b"\xff\xfe\xfa", "is damaged: 'utf-8' codec can't decode"),
        (of_number("NaN", float("nan")), "is damaged: NaN is not a number of JSON"),
        (of_number("-Infinity", -INF), "is damaged: -Infinity is not a number of JSON"),
        (of_number("1e999", INF), "is damaged: 1e999 is too large"),
        (of_number("1" + "0" * 400 + ".0", INF), "is damaged: 1" + "0" * 19 + " is too large"),
    ],
    ids=lambda value: repr(value)[:30],
)
def test_what_is_no_document(path, content, reason):
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert reason in refusal(read_document, path)


def test_what_cannot_be_written_or_read(tmp_path, path):
    (tmp_path / "file").write_text("")
    below = tmp_path / "file" / "a.json"
    assert "cannot be written" in refusal(write_document, below, DATA, kind=StoreError)
    assert "cannot be read" in refusal(read_document, path, kind=StoreError)
    with pytest.raises(ValueError, match="JSON"):
        write_document(path, {"a": float("nan")})
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]


def test_a_file_of_16_mebibytes_is_the_largest(path):
    write_document(path, {"a": ""})
    text = "x" * (LARGEST - path.stat().st_size)
    write_document(path, {"a": text})
    assert path.stat().st_size == LARGEST
    assert read_document(path) == {"a": text}
    reason = "cannot be written: it would be too large to be read again"
    assert refusal(write_document, path, {"a": text + "x"}, kind=StoreError) == reason
    assert path.stat().st_size == LARGEST
    path.write_bytes(path.read_bytes() + b" ")
    assert "16.8 MB, more than rbstab ever writes" in refusal(read_document, path)


@pytest.mark.parametrize(("entry", "most"), [(1, 48), ([], 24), ({}, 24)])
def test_a_file_of_many_small_values_is_too_large(path, monkeypatch, entry, most):
    """Commas and opening brackets are counted: two more than the entries of the one list."""
    more = {"a": [entry] * (most + 1)}
    write_document(path, more)
    monkeypatch.setattr(document, "MAX_VALUES", 50)
    assert refusal(read_document, path) == "is damaged: it has too many values"
    assert "too large to be read again" in refusal(write_document, path, more, kind=StoreError)
    write_document(path, {"a": [entry] * most})
    assert read_document(path) == {"a": [entry] * most}


class Part(BaseModel):
    """A part of a model."""

    model_config = ConfigDict(extra="forbid")
    sizes: tuple[int, ...]


class Whole(BaseModel):
    """A model with a part."""

    model_config = ConfigDict(extra="forbid")
    count: int
    part: Part


GOOD = {"count": 3, "part": {"sizes": [1, 2]}}


@pytest.mark.parametrize(
    ("wrong", "key"),
    [
        ({"count": "3"}, "count"),
        ({"count": 3.0}, "count"),
        ({"count": True}, "count"),
        ({"part": {"sizes": [1, "2"]}}, "part.sizes.1"),
        ({"count": None, "part": None}, "count"),
        ({"more": 1}, "more"),
        ({"\x1b[31m": 1}, "\\x1b[31m"),
        ({"x" * 201: 1}, "x" * 197 + "..."),
    ],
)
def test_data_of_other_types_are_refused_with_the_first_key(path, wrong, key):
    """No value is converted to the type of its key."""
    write_document(path, GOOD)
    assert read_model(path, Whole) == Whole(count=3, part=Part(sizes=(1, 2)))
    message = refusal(checked, path, GOOD | wrong, Whole)
    assert message.startswith(f"is damaged: {key}: ")
    assert message.isprintable()
