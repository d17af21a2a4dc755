"""Protects JSON documents: too much data, odd numbers, and values of other types are refused."""

import hashlib
import json

import pytest
from pydantic import BaseModel, ConfigDict

from rbstab.store import document
from rbstab.store.document import checked, read_document, read_model, write_document
from rbstab.store.errors import NotAResultError, StoreError

LARGEST = 16 << 20


def refusal(kind, function, *arguments):
    with pytest.raises(StoreError) as caught:
        function(*arguments)
    assert type(caught.value) is kind
    return str(caught.value)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.json"


def test_a_file_of_16_mebibytes_is_the_largest(path):
    write_document(path, {"a": ""})
    text = "x" * (LARGEST - path.stat().st_size)
    write_document(path, {"a": text})
    assert path.stat().st_size == LARGEST
    assert read_document(path) == {"a": text}
    reason = "cannot be written: it would be too large to be read again"
    assert refusal(StoreError, write_document, path, {"a": text + "x"}) == f"{path} {reason}"
    assert path.stat().st_size == LARGEST
    path.write_bytes(path.read_bytes() + b" ")
    assert "16.8 MB, more than rbstab ever writes" in refusal(NotAResultError, read_document, path)


@pytest.mark.parametrize(("entry", "most"), [(1, 48), ([], 24), ({}, 24)])
def test_a_file_of_many_small_values_is_too_large(path, monkeypatch, entry, most):
    """Commas and opening brackets are counted: two more than the entries of the one list."""
    with monkeypatch.context() as patch:
        patch.setattr(document, "MAX_VALUES", 50)
        write_document(path, {"a": [entry] * most})
        assert read_document(path) == {"a": [entry] * most}
        more = {"a": [entry] * (most + 1)}
        assert "too large to be read again" in refusal(StoreError, write_document, path, more)
    write_document(path, more)
    assert read_document(path) == more
    monkeypatch.setattr(document, "MAX_VALUES", 50)
    reason = "is damaged: it has too many values"
    assert refusal(NotAResultError, read_document, path) == f"{path} {reason}"


@pytest.mark.parametrize(
    ("text", "value", "reason"),
    [
        ("NaN", float("nan"), "NaN is not a number of JSON"),
        ("-Infinity", -float("inf"), "-Infinity is not a number of JSON"),
        ("1e999", float("inf"), "1e999 is too large"),
        ("1" + "0" * 400 + ".0", float("inf"), "1" + "0" * 19 + " is too large"),
    ],
)
def test_numbers_that_are_not_finite_are_refused_under_a_right_digest(path, text, value, reason):
    digest = hashlib.sha256(json.dumps({"a": value}).encode()).hexdigest()
    path.write_text(f'{{"a": {text}, "digest": "{digest}"}}')
    assert refusal(NotAResultError, read_document, path) == f"{path} is damaged: {reason}"


def test_the_order_of_keys_does_not_count(path):
    """Other programs may write the keys in another order."""
    write_document(path, {"b": 1, "a": {"d": 2, "c": 3}})
    data = json.loads(path.read_text())
    path.write_text(json.dumps(dict(reversed(data.items()))))
    assert read_document(path) == {"b": 1, "a": {"d": 2, "c": 3}}


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


def test_data_that_fit_become_a_model(path):
    write_document(path, GOOD)
    assert read_model(path, Whole) == Whole(count=3, part=Part(sizes=(1, 2)))


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
        ({"é" * 30: 1}, ("\\xe9" * 30)[:100]),
        ({"x" * 100: 1}, "x" * 100),
        ({"x" * 101: 1}, "x" * 100),
    ],
)
def test_data_of_other_types_are_refused_with_the_first_key(path, wrong, key):
    """No value is converted to the type of its key."""
    message = refusal(NotAResultError, checked, path, GOOD | wrong, Whole)
    start = f"{path} is damaged: {key}: "
    assert message.startswith(start)
    assert message[len(start) :].isprintable()
