"""Inertia and gains are three numbers or a symmetric matrix, definite or semidefinite."""

import numpy as np
import pytest
from support.configs import BY_VARIANT, edited

from rbstab.config.load import resolved_yaml, run_id

INERTIA = "inertia: [10.0, 8.0, 0.4]"
DAMPING = "L_r: [60, 60, 42]"


SEMIDEFINITE = [
    ("0", (0.0, 0.0, 0.0)),
    ("-0.0", (0.0, 0.0, 0.0)),
    ("[60, 0, 42]", (60.0, 0.0, 42.0)),
    ("[[1, 1, 0], [1, 1, 0], [0, 0, 0]]", ((1.0, 1.0, 0.0), (1.0, 1.0, 0.0), (0.0, 0.0, 0.0))),
]


@pytest.mark.parametrize("text", BY_VARIANT.values(), ids=BY_VARIANT)
@pytest.mark.parametrize("key", ["K_t", "L_t", "K_r", "L_r"])
def test_gains_of_the_stabilizers_may_be_zero_or_left_out(load, text, key):
    """A gain that is left out is the same config, with the same id, as one that is zero."""
    (line,) = [line for line in text.splitlines() if line.startswith(f"  {key}:")]
    for value, expected in SEMIDEFINITE:
        config = load(text.replace(line, f"  {key}: {value}"))
        assert getattr(config.controller, key) == expected
        assert load(resolved_yaml(config)) == config
    without = load(text.replace(f"{line}\n", ""))
    assert run_id(without) == run_id(load(text.replace(line, f"  {key}: 0")))


def test_an_anchor_under_load_needs_a_regular_stiffness(complaints, load):
    for value in ("0", "[1, 1, 0]", "[[1, 1, 0], [1, 1, 0], [0, 0, 1]]"):
        text = edited("K_t: [4100, 4100, 3280]", f"K_t: {value}\n  anchor: equilibrium")
        (message,) = complaints(text)
        assert "controller.anchor: is `equilibrium`, where K_t alone carries" in message
    load(edited("K_t: [4100, 4100, 3280]", "K_t: [1, 1, 1e-9]\n  anchor: equilibrium"))


def test_accepted(load):
    """A full matrix stays a full matrix; a small definite matrix is definite."""
    rng = np.random.default_rng(5)
    for scale in (1e-9, 1.0, 1e9):
        root = rng.normal(size=(3, 3))
        matrix = scale * (root @ root.T + 0.01 * np.eye(3))
        matrix = 0.5 * (matrix + matrix.T)
        config = load(edited(DAMPING, f"L_r: {matrix.tolist()}"))
        assert np.array_equal(config.controller.L_r, matrix)
    assert load(edited(DAMPING, "L_r: [1e-9, 1, 1e9]")).controller.L_r == (1e-9, 1.0, 1e9)


def test_a_matrix_that_is_barely_definite(load):
    config = load(edited(INERTIA, "inertia: [[1, 0, 0], [0, 1, 0], [0, 0, 1e-13]]"))
    assert config.body.inertia[2] == (0.0, 0.0, 1e-13)


def test_off_diagonal_entries_may_be_negative(load):
    config = load(edited(DAMPING, "L_r: [[2, -1, 0], [-1, 2, -1], [0, -1, 2]]"))
    assert config.controller.L_r == ((2.0, -1.0, 0.0), (-1.0, 2.0, -1.0), (0.0, -1.0, 2.0))
