"""Protects result files: the reader gets exactly what was written, with names, units and texts."""

import dataclasses

import numpy as np
import pytest
from support.results import assert_equal, result

import rbstab
from rbstab.store.result import open_result, write_result


def test_to_the_last_bit(tmp_path):
    path = tmp_path / "a" / "b.h5"
    write_result(str(path), result())
    assert_equal(open_result(str(path)), result())
    with pytest.raises(dataclasses.FrozenInstanceError):
        result().config = ""  # type: ignore[misc]  # The test writes to a frozen field on purpose.


TEXTS = ["", "a", "é😀", "a\nb", "x" * 200_000, " a ", "\t", "1", "\x1b[31m"]


@pytest.mark.parametrize("text", TEXTS)
def test_texts_survive(tmp_path, text):
    original = result()
    attributes = original.attributes | {"title": text, "status_detail": text}
    written = dataclasses.replace(original, attributes=attributes, config=text)
    write_result(tmp_path / "a.h5", written)
    assert_equal(open_result(tmp_path / "a.h5"), written)


@pytest.mark.parametrize("field", ["title", "config"])
def test_a_text_with_a_null_character_is_no_traceback(tmp_path, field):
    original = result()
    if field == "title":
        written = dataclasses.replace(original, attributes=original.attributes | {"title": "a\0b"})
    else:
        written = dataclasses.replace(original, config="a\0b")
    try:
        write_result(tmp_path / "a.h5", written)
    except rbstab.StoreError:
        return
    assert_equal(open_result(tmp_path / "a.h5"), written)


def test_the_file_does_not_depend_on_the_layout_in_memory(tmp_path):
    original = result()
    variables = dict(original.variables)
    energy = variables["energy"]
    variables["energy"] = energy._replace(data=np.asfortranarray(energy.data))
    strided = np.repeat(variables["lyapunov"].data, 2)[::2]
    variables["lyapunov"] = variables["lyapunov"]._replace(data=strided)
    write_result(tmp_path / "a.h5", dataclasses.replace(original, variables=variables))
    assert_equal(open_result(tmp_path / "a.h5"), original)
