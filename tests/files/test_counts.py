"""Counts in sentences: commas between thousands from 10,000 on."""

import numpy as np
import pytest

from rbstab.files.text import grouped


@pytest.mark.parametrize(
    ("count", "text"),
    [(0, "0"), (9999, "9999"), (10_000, "10,000"), (1_048_576, "1,048,576"), (-20_000, "-20,000")],
)
def test_separators(count, text):
    assert grouped(count) == text
    assert grouped(np.int64(count)) == text


def test_a_count_is_a_whole_number():
    with pytest.raises(TypeError):
        grouped(10_000.5)  # type: ignore[arg-type]
