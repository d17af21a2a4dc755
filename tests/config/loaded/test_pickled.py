"""A config reaches a worker process unchanged: it can be pickled, with all its sections."""

import pickle

import pytest
from support.configs import BY_VARIANT, edited

SLIDING = edited("variant: visco-elastic", "variant: sliding")
SLIDING = "".join(f"{line}\n" for line in SLIDING.splitlines() if "_c:" not in line)
SLIDING = edited("  K_t:", "  K_s: [1, 2, 3]\n  surface: {slope: 20}\n  K_t:", SLIDING)


@pytest.mark.parametrize("text", [*BY_VARIANT.values(), SLIDING])
def test_it_comes_back(load, text):
    config = load(text)
    again = pickle.loads(pickle.dumps(config))  # noqa: S301  # made on the same line
    assert again == config
    assert type(again.controller) is type(config.controller)
