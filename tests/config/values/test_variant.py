"""The variant decides which keys are allowed, so it is checked first."""

import pytest
from support.configs import VISCO_ELASTIC, edited

ALL = "expected one of free, permanent, visco-elastic, embedded, sliding"

VISCO = f"{ALL}; did you mean visco-elastic?"

WRONG = [
    ("rigid", f"7:12: controller.variant: is the text 'rigid' ({ALL})"),
    (
        "visco_elastic",
        f"7:12: controller.variant: is the text 'visco_elastic' ({VISCO})",
    ),
    (
        "Visco Elastic",
        f"7:12: controller.variant: is the text 'Visco Elastic' ({VISCO})",
    ),
    ("[free]", f"7:12: controller.variant: is a list of 1 ({ALL})"),
    ("{free: 1}", f"7:12: controller.variant: is a mapping ({ALL})"),
    ("true", f"7:12: controller.variant: is true ({ALL})"),
    ("1", f"7:12: controller.variant: is 1 ({ALL})"),
    ("", f"7:11: controller.variant: is empty ({ALL})"),
]


@pytest.mark.parametrize(("value", "expected"), WRONG)
def test_unknown_variant(complaints, value, expected):
    assert complaints(edited("variant: visco-elastic", f"variant: {value}")) == [expected]


def test_the_other_keys_are_judged_by_the_variant_that_was_meant(complaints):
    text = edited("variant: visco-elastic", "variant: visco")
    text = edited("  K_t:", "  K_s: [1, 1, 1]\n  K_t:", text)
    variant, key = complaints(edited("duration: 2.0", "duration: 2.0\n  steps: 1", text))[:2]
    assert variant == f"7:12: controller.variant: is the text 'visco' ({VISCO})"
    assert key.startswith("8:3: controller.K_s: is not a key of the variant visco-elastic")
    free = complaints(edited("variant: visco-elastic", "variant: Free"))
    assert [line.partition(": is")[0] for line in free] == [
        "7:12: controller.variant",
        "12:3: controller.K_c",
        "13:3: controller.L_c",
    ]


def test_no_variant(complaints):
    found = complaints(edited("  variant: visco-elastic\n", ""))
    assert found == [f"7:3: controller.variant: is missing ({ALL})"]


def test_what_does_not_depend_on_the_variant_is_reported_too(complaints):
    text = edited("variant: visco-elastic", "variant: rigid")
    text = edited("mass: 41.0", "mass: -41.0", text)
    text = edited("orientation:", "orientaton:", text)
    text = edited("duration: 2.0", "duration: 0", text)
    assert complaints(text) == [
        "3:9: body.mass: is -41 (expected a number greater than 0)",
        f"7:12: controller.variant: is the text 'rigid' ({ALL})",
        "15:3: initial.orientaton: is unknown (did you mean orientation?)",
        "18:13: integration.duration: is 0 (expected a number greater than 0)",
    ]


# Right for one variant and wrong for another: not checked while the variant is unknown.
UNDECIDED = [
    edited("  K_t:", "  K_s: [1, 1, 1]\n  K_t:"),
    edited("initial:", "initial:\n  connector_state: [0, 0, 0]"),
    edited("initial:", "initial:\n  position: [0, 0]"),
    edited("initial:", "initial:\n  position: [0, x, 0]"),
    VISCO_ELASTIC + "  coordinates: reduced\n",
    VISCO_ELASTIC + "  drift_control: none\n",
]


@pytest.mark.parametrize("text", UNDECIDED)
def test_what_depends_on_the_variant_is_not_judged_without_it(complaints, text):
    (message,) = complaints(edited("variant: visco-elastic", "variant: rigid", text))
    assert ": controller.variant: is the text 'rigid'" in message


@pytest.mark.parametrize(
    ("value", "found"),
    [("3", "3"), ("0", "0"), ("-1", "-1"), ("999", "999")],
)
def test_schema_version(complaints, value, found):
    expected = "which this version of rbstab cannot read (expected 1 or 2)"
    assert complaints(f"{VISCO_ELASTIC}schema_version: {value}\n") == [
        f"20:17: schema_version: is {found}, {expected}"
    ]


@pytest.mark.parametrize("value", ['"1"', "one", "~", "[1]", "1.5"])
def test_schema_version_of_the_wrong_kind(complaints, value):
    (message,) = complaints(f"{VISCO_ELASTIC}schema_version: {value}\n")
    assert message.startswith("20:17: schema_version: is ")
    assert "(expected the whole number 1 or 2)" in message


def test_schema_version_that_only_equals_one(complaints):
    complaints(f"{VISCO_ELASTIC}schema_version: true\n")


@pytest.mark.parametrize("version", [1, 2])
def test_known_schema_versions(load, version):
    assert load(VISCO_ELASTIC + f"schema_version: {version}\n").schema_version == version
