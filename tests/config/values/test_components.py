"""A list of numbers of any length becomes a tuple; other lengths and types are refused."""

import pytest
from pydantic import ValidationError, create_model

from rbstab.config.quantities import components
from rbstab.config.section import Section


def check(size, value):
    """Return a value of a key with this many numbers, as a config has it after loading."""
    model = create_model("Numbers", __base__=Section, numbers=(components(size), ...))
    return model.model_validate({"numbers": value}).model_dump()["numbers"]


@pytest.mark.parametrize("size", [1, 2, 3, 4])
def test_the_length_is_exact(size):
    numbers = [0.5 * k for k in range(size)]
    assert check(size, numbers) == tuple(numbers)
    for wrong in (numbers[:-1], [*numbers, 1.0], [0.0] * 1000):
        with pytest.raises(ValidationError):
            check(size, wrong)


@pytest.mark.parametrize("wrong", [{1.0, 2.0}, "12", 1.0, None, [1.0, "2"], [1.0, True]])
def test_what_is_no_list_of_numbers(wrong):
    with pytest.raises(ValidationError):
        check(2, wrong)


def test_minus_zero_becomes_zero():
    """They are equal, so they must have the same text."""
    assert str(check(2, [-0.0, 1.0])) == "(0.0, 1.0)"
