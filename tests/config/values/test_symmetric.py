"""Gains that need not be positive are three numbers or a symmetric matrix, of any signs."""

import pytest
from pydantic import ValidationError, create_model

from rbstab.config.quantities import Symmetric
from rbstab.config.section import Section


def check(value):
    """Return a value of a key with a symmetric matrix, as a config has it after loading."""
    model = create_model("Gains", __base__=Section, gain=(Symmetric, ...))
    return model.model_validate({"gain": value}).model_dump()["gain"]


@pytest.mark.parametrize(
    "value", [[1, -2, 0], [[1, 2, 3], [2, -4, 5], [3, 5, 0]], [[0, 0, 0], [0, 0, 0], [0, 0, 0]]]
)
def test_accepted(value):
    tuples = tuple(tuple(row) if isinstance(row, list) else row for row in value)
    assert check(value) == tuples


@pytest.mark.parametrize(
    "value", [[], [1, 2], [1, 2, 3, 4], [[1, 2, 3]], [[1, 2, 3], [2, 4, 5], [3, 5.1, 0]], 1, "abc"]
)
def test_refused(value):
    with pytest.raises(ValidationError):
        check(value)
