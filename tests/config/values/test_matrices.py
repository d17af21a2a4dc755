"""Inertia and gains are three numbers or a symmetric matrix, definite or semidefinite."""

import numpy as np
import pytest
from support.configs import BY_VARIANT, EMBEDDED, edited

from rbstab.config.load import resolved_yaml, run_id

INERTIA = "inertia: [10.0, 8.0, 0.4]"
DAMPING = "L_r: [60, 60, 42]"

NUMBERS = "expected three numbers or a 3x3 matrix"

REFUSED = [
    ("[1, 2]", ["body.inertia: has 2 entries (expected 3)"]),
    ("[1, 2, 3, 4]", ["body.inertia: has 4 entries (expected 3)"]),
    ("[0, 1, 1]", ["body.inertia[0]: is 0 (expected a number greater than 0)"]),
    ("[1, 1, -1]", ["body.inertia[2]: is -1 (expected a number greater than 0)"]),
    ("[1, .inf, 1]", ["body.inertia[1]: is inf (expected a finite number)"]),
    ("[1, true, 1]", ["body.inertia[1]: is true (expected a number)"]),
    ("[[1, 0, 0]]", ["body.inertia: has 1 entry (expected 3)"]),
    ("[]", ["body.inertia: has 0 entries (expected 3)"]),
    ("5", [f"body.inertia: is 5 ({NUMBERS}; [5, 5, 5] for all three axes)"]),
    ("0.1", [f"body.inertia: is 0.1 ({NUMBERS}; [0.1, 0.1, 0.1] for all three axes)"]),
    ("-5", [f"body.inertia: is -5 ({NUMBERS})"]),
    ("true", [f"body.inertia: is true ({NUMBERS})"]),
    ("5 kg m^2", [f"body.inertia: is the text '5 kg m^2' ({NUMBERS})"]),
    ("", [f"body.inertia: is empty ({NUMBERS})"]),
    ("{xx: 1}", [f"body.inertia: is a mapping ({NUMBERS})"]),
    ("[[1, 0, 0], [0, 1, 0]]", ["body.inertia: has 2 entries (expected 3)"]),
    ("[[1, 0, 0], [0, 1], [0, 0, 1]]", ["body.inertia[1]: has 2 entries (expected 3)"]),
    ("[[1, 0, 0], [0, 1, 0], 1]", ["body.inertia[2]: is 1 (expected a list of 3)"]),
    ("[[1, 0, 0], [0, x, 0], [0, 0, 1]]", ["body.inertia[1][1]: is the text 'x' (expected a num"]),
    ("[[1, 0, 0], [0, 1, 0], [0, 0, .nan]]", ["body.inertia[2][2]: is nan (expected a finite"]),
    (
        "[[a, 0, 0], [0, .inf, 0], [0, 0, 1]]",
        [
            "body.inertia[0][0]: is the text 'a' (expected a number)",
            "body.inertia[1][1]: is inf (expected a finite number)",
        ],
    ),
    ("[[1, 2, 0], [0, 9, 0], [0, 0, 1]]", ["body.inertia: is not symmetric (expected a symmetric"]),
    # Asymmetric by one unit in the last place: both halves of a matrix are written alike.
    (
        "[[1, 0, 0.1], [0, 1, 0], [0.10000000000000002, 0, 1]]",
        ["body.inertia: is not symmetric (expected a symmetric"],
    ),
    (
        "[[1, 0, 0], [0, 1, 0], [0, 0, -1]]",
        ["body.inertia: is not positive definite, its smallest eigenvalue is -1 (exp"],
    ),
    (
        "[[1, 2, 0], [2, 1, 0], [0, 0, 1]]",
        ["body.inertia: is not positive definite, its smallest eigenvalue is -1 (exp"],
    ),
    ("[[0, 0, 0], [0, 0, 0], [0, 0, 0]]", ["body.inertia: is not positive definite"]),
    # Singular: the computed smallest eigenvalue is of the order of round-off.
    ("[[1, 1, 1], [1, 1, 1], [1, 1, 1]]", ["body.inertia: is not positive definite"]),
    (
        "[[0.1, 0.2, 0.3], [0.2, 0.4, 0.6], [0.3, 0.6, 0.9]]",
        ["body.inertia: is not positive definite"],
    ),
]


@pytest.mark.parametrize(("value", "expected"), REFUSED)
def test_refused(complaints, value, expected):
    found = complaints(edited(INERTIA, f"inertia: {value}"))
    assert len(found) == len(expected)
    for message, part in zip(found, expected, strict=True):
        assert message.startswith("4:")
        assert part in message


def test_places_of_a_matrix(complaints):
    found = complaints(edited(INERTIA, "inertia: [[1, 0, 0], [0, x, 0], [0, y, 1]]"))
    assert [message.split(" ")[0] for message in found] == ["4:28:", "4:39:"]
    found = complaints(edited(INERTIA, "inertia: [[1, 2, 0], [0, 1, 0], [0, 0, 1]]"))
    assert found[0].startswith("4:12:")


def test_places_of_a_matrix_in_rows(complaints):
    rows = "\n    - [1, 0, 0]\n    - [0, 1, 0]\n    - [0, 0, z]"
    (message,) = complaints(edited(INERTIA, f"inertia:{rows}"))
    assert message.startswith("7:14: body.inertia[2][2]: is the text 'z'")


@pytest.mark.parametrize("key", ["K_t", "L_t", "K_r", "L_r", "K_c", "L_c"])
def test_no_gain_may_be_indefinite(complaints, key):
    definite = "definite" if key.endswith("_c") else "semidefinite"
    lines = edited("title: Case", "title: Gains").splitlines()
    (index,) = [i for i, line in enumerate(lines) if line.startswith(f"  {key}:")]
    lines[index] = f"  {key}: [[1, 2, 0], [2, 1, 0], [0, 0, 1]]"
    (message,) = complaints("\n".join(lines))
    assert message.startswith(f"{index + 1}:8: controller.{key}: is not positive {definite}, its")
    lines[index] = f"  {key}: [1, 2, -3]"
    (message,) = complaints("\n".join(lines))
    assert message.startswith(f"{index + 1}:15: controller.{key}[2]: is -3")


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


@pytest.mark.parametrize("key", ["K_c", "L_c", "K_d", "L_d"])
def test_gains_of_a_connector_must_be_positive(complaints, key):
    (line,) = [line for line in EMBEDDED.splitlines() if line.startswith(f"  {key}:")]
    (message,) = complaints(EMBEDDED.replace(line, f"  {key}: [60, 0, 42]"))
    assert message.endswith(f"controller.{key}[1]: is 0 (expected a number greater than 0)")
    (message,) = complaints(EMBEDDED.replace(f"{line}\n", ""))
    assert message.endswith(f"controller.{key}: is missing (it is required)")


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


SINGULAR = [
    "[[0.41, 0.42, 0.49], [0.42, 0.45, 0.57], [0.49, 0.57, 0.82]]",
    "[[0.72, 0.72, -0.36], [0.72, 0.9, 0.0], [-0.36, 0.0, 0.9]]",
    "[[0.97, -0.13, -0.16], [-0.13, 0.89, 0.6], [-0.16, 0.6, 0.41]]",
]


@pytest.mark.parametrize("value", SINGULAR)
def test_a_singular_matrix_whose_smallest_eigenvalue_is_computed_as_positive(complaints, value):
    """The exact determinant is zero; the computed eigenvalue is about 1e-17."""
    (message,) = complaints(edited(INERTIA, f"inertia: {value}"))
    assert message.startswith("4:12: body.inertia: is not positive definite")


def test_a_matrix_that_is_barely_definite(load):
    config = load(edited(INERTIA, "inertia: [[1, 0, 0], [0, 1, 0], [0, 0, 1e-13]]"))
    assert config.body.inertia[2] == (0.0, 0.0, 1e-13)


def test_off_diagonal_entries_may_be_negative(load):
    config = load(edited(DAMPING, "L_r: [[2, -1, 0], [-1, 2, -1], [0, -1, 2]]"))
    assert config.controller.L_r == ((2.0, -1.0, 0.0), (-1.0, 2.0, -1.0), (0.0, -1.0, 2.0))


def test_a_matrix_too_stiff_to_decide_is_not_called_indefinite_with_a_positive_eigenvalue(
    complaints,
):
    (message,) = complaints(edited(INERTIA, "inertia: [[1, 0, 0], [0, 1, 0], [0, 0, 1e-200]]"))
    assert "smallest eigenvalue is 1e-200 (expected positive eigenvalues)" not in message
