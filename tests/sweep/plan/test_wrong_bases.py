"""Protects the errors of plans with a wrong base: each is told at its place, with all others."""

import pytest
from support.configs import PLAN, VISCO_ELASTIC, edited

BASES = [
    (
        "base: nowhere.yaml",
        "2:7: base: is the text 'nowhere.yaml', which is not a file"
        " (expected the path of a config, relative to the plan)",
    ),
    ("base: 5", "2:7: base: is 5 (expected the path of a config, or a config)"),
    ("base:", "2:6: base: is empty (expected the path of a config, or a config)"),
    ("base: ''", "2:7: base: is the text '' (expected the path of a config, or a config)"),
    ("base: [a]", "2:7: base: is a list of 1 (expected the path of a config, or a config)"),
    ("base: {}", "2:7: base.body: is missing (it is required)"),
]


@pytest.mark.parametrize(("line", "expected"), BASES)
def test_base(complaints, line, expected):
    assert complaints(edited("base: visco-elastic.yaml", line, PLAN))[0] == expected


def test_problems_of_the_base_are_told_at_their_place(complaints, tmp_path):
    (tmp_path / "wrong.yaml").write_text(edited("mass: 41.0", "mass: -1"))
    assert complaints(edited("visco-elastic.yaml", "wrong.yaml", PLAN), "controller.K_t=1") == [
        "--set controller.K_t:1:16: controller.K_t: is 1 (expected three numbers or a 3x3 matrix)",
        "wrong.yaml:3:9: body.mass: is -1 (expected a number greater than 0)",
    ]
    assert complaints(edited("visco-elastic.yaml", "wrong.yaml", PLAN), "body") == [
        "--set body:1:1: is not an assignment of a key (expected key=value with a key like "
        "body.inertia[0])",
        "wrong.yaml:3:9: body.mass: is -1 (expected a number greater than 0)",
    ]
    (tmp_path / "wrong.yaml").write_text("[]")
    assert complaints(edited("visco-elastic.yaml", "wrong.yaml", PLAN)) == [
        "wrong.yaml:1:1: is a list of 0 (expected a mapping)"
    ]


def test_problems_of_a_base_that_is_written_out(complaints):
    inside = "".join(f"  {line}\n" for line in VISCO_ELASTIC.splitlines())
    inside = edited("mass: 41.0", "mass: -1", edited("K_t:", "Kt:", inside))
    text = edited("base: visco-elastic.yaml\n", f"base:\n{inside}", PLAN)
    assert complaints(text) == [
        "5:11: base.body.mass: is -1 (expected a number greater than 0)",
        "10:5: base.controller.Kt: is unknown (did you mean K_t?)",
    ]
    twice = edited("mass: -1", "mass: *a\n    mass: 2", text)
    assert [message.split(":")[0] for message in complaints(twice)] == ["5", "6", "11"]


@pytest.mark.parametrize("base", ["nowhere.yaml", "wrong.yaml", "[]"])
def test_a_wrong_base_does_not_hide_what_else_is_wrong(complaints, tmp_path, base):
    (tmp_path / "wrong.yaml").write_text(edited("mass: 41.0", "mass: -1"))
    keys = (
        "  body.mass: {values: [40, 50]}\n  controller.K_rr[0]: {values: [1, 2]}\n"
        "  controller.K_r[0]: {values: [1]}\n  elements.rope.any: {values: [2]}\n"
        "  gravity[2]: {values: [1]}\n  initial.orientation[0]: {values: [0]}\n"
    )
    text = edited("  body.mass: {values: [40, 50]}\n", keys, PLAN)
    text = edited("visco-elastic.yaml", base, text)
    place = "wrong.yaml:3:9: body.mass: " if base == "wrong.yaml" else "2:7: base: "
    key = "5:3: vary.controller.K_rr[0]: is in no config (did you mean controller.K_r?)"
    kept = edited("visco-elastic.yaml", base, edited("summary", "{traces: [0, 7]}", PLAN))
    number = "6:16: keep.traces: has 7 (expected members below 2)"
    for plan, expected in ((text, key), (kept, number)):
        lines = complaints(plan)
        assert len(lines) == 2
        assert expected in lines
        assert any(line.startswith(place) for line in lines)


@pytest.mark.parametrize("variant", ["free", "permanent"])
def test_a_base_without_controller_has_no_variant_that_varies(complaints, variant):
    body = "{mass: 12, inertia: [1, 1, 1], contact_point: [0, 0, -1]}"
    assert complaints(
        f"base:\n  schema_version: 2\n  body: {body}\n  integration: {{duration: 1, samples: 5}}\n"
        f"vary:\n  controller.variant: {{values: [{variant}]}}\n"
    ) == ["2:3: base: has no controller (expected controller in the base, whose variant varies)"]
