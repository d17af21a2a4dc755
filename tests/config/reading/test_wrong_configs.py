"""Wrong configs are refused with all their problems at once, each with its place and its key.

In an edit, » marks the place of each problem; the mark itself is no part of the config.
"""

import pytest
from support.config_elements import YAML
from support.configs import EMBEDDED, FREE, MANIFOLD, PERMANENT, SLIDING, VISCO_ELASTIC, edited
from support.json_schemas import schema_errors, validator_of

from rbstab.config.schema import json_schema

MASS, INERTIA, POINT = "mass: 41.0", "inertia: [10.0, 8.0, 0.4]", "[0.15, 0.10, -0.42]"
ORIENTATION, DURATION, SAMPLES = "orientation: [0, 0, 0]", "duration: 2.0", "samples: 11"
UPRIGHT = "{kind: attitude, K: [400, 400, 320], L: [60, 60, 42]}"
LOAD = "kind: input, quantity: couple, direction: [0, 0, 1], amplitude: 1, signal"
TABLE = f"{{{LOAD}: {{kind: table"
STIFF = "kind: guard, method: stiff, stiffness: 4, soft_angle"
STOP = "kind: guard, method: stop, angle: 0.3, restitution"
LINE = """\
kind: ligament, point: [0, 0, 0], anchor: [1, 0, 0], stiffness: 8, slack_length: 1, toe_strain: 0.1
"""[:-1]
NOISE = f"{LOAD}: {{kind: noise, seed: 1, rate: 10, correlation_time: 0.3}}"
DURATION_ALONE = "\nintegration: {duration: 2}"
END = UPRIGHT + DURATION_ALONE
PROJECTED = MANIFOLD + "  drift_control: projection\nschema_version: 2\n"
IMPLICIT = edited("position", "position\n  law: {implicit: 0.001}", SLIDING)
IMPLICIT += "schema_version: 2\n"


def edits(old, new, keys, *values):
    """Return edits that put some values into a text, all with problems of the same keys."""
    return [(old, new.replace("{}", value), keys) for value in values]


# An edit of a config, and the key of each of its problems, with its place where no mark shows it:
# the JSON Schema for editors refuses it as well.
KEYS = {
    VISCO_ELASTIC: [
        # Keys: unknown, missing, repeated, or of another variant.
        ("title:", "»titel:", "titel"),
        ("initial:", "»Initial:", "Initial"),
        (SAMPLES, "samples: 11\n  »qqq: 1", "integration.qqq"),
        (SAMPLES, "samples: 11\n»null: red", "null"),
        (SAMPLES, "samples: 11\n»<matrix>: red", "<matrix>"),
        ("  K_t:", "  »diagonal: 1\n  K_t:", "controller.diagonal"),
        ("  K_t:", "  »K_d: [1, 1, 1]\n  K_t:", "controller.K_d"),
        ("initial:", "initial:\n  »connector_state: [0, 0, 0]", "initial.connector_state"),
        (SAMPLES, "samples: 11\n  »drift_control: none", "integration.drift_control"),
        ("  mass: 41.0\n", "", "3:3 body.mass"),
        ("visco-elastic", "embedded", "7:3 controller.K_d, 7:3 controller.L_d"),
        (SAMPLES, "samples: 11\nreference: »{}", "reference.source"),
        # Sections that are no mapping.
        ("controller:\n", "controller: »5\n»more:\n", "controller, more"),
        *edits(SAMPLES, "samples: 11\nreference: »{}", "reference", "paper", "5"),
        (SAMPLES, "samples: 11\nbound: »{couple: 1}", "bound.tilt"),
        (SAMPLES, "samples: 11\nbound: {tilt: »1}", "bound.tilt"),
        (SAMPLES, "samples: 11\nbound: {couple: 1, point: »[0, 0, 1], tilt: 1}", "bound.point"),
        *edits(
            *(SAMPLES, "samples: 11\nbound: {force: »{}, tilt: 1}", "bound.force"),
            *("0", "-1", "1e10", "'1 N'"),
        ),
        # Numbers.
        *edits(MASS, "mass: »{}", "body.mass", "-1", "0", "true", "'41'", "41 kg", "4,1"),
        *edits(MASS, "mass: »{}", "body.mass", "[41.0]", "{}", "~"),
        (MASS, "mass:»", "body.mass"),
        *edits(DURATION, "duration: »{}", "integration.duration", "0", "-1"),
        *edits(SAMPLES, "samples: »{}", "integration.samples", "1", "true", "11.5", "'11'"),
        (SAMPLES, "samples: »1000001", "integration.samples"),
        (SAMPLES, "samples: 11\n  rtol: »1e-17", "integration.rtol"),
        (SAMPLES, "samples: 11\n  step_limit: »1.5", "integration.step_limit"),
        (SAMPLES, "samples: 11\n  coordinates: »manifold", "integration.coordinates"),
        # Texts.
        ("title: Case", "title: »5", "title"),
        # Vectors.
        *edits(POINT, "»{}", "body.contact_point", "[1, 2]", "[]", "0.15 0.1 -0.42", "{deg: 1}"),
        (POINT, "[».inf, 2, »x]", "body.contact_point[0], body.contact_point[2]"),
        (POINT, "[1, »[2], »true]", "body.contact_point[1], body.contact_point[2]"),
        (POINT, "\n    - 1\n    - 2\n    - »z", "body.contact_point[2]"),
        # Matrices.
        *edits(INERTIA, "inertia: »{}", "body.inertia", "[1, 2, 3, 4]", "5", "[[1, 0, 0]]"),
        (INERTIA, "inertia: [»0, 1, 1]", "body.inertia[0]"),
        (INERTIA, "inertia: [[1, 0, 0], »[0, 1], »1]", "body.inertia[1], body.inertia[2]"),
        (INERTIA, "inertia: [[1, 0, 0], [0, »x, 0], [0, 0, 1]]", "body.inertia[1][1]"),
        ("L_r: [60, 60, 42]", "L_r: [1, 2, »-3]", "controller.L_r[2]"),
        ("L_c: [600, 600, 420]", "L_c: [600, »0, 420]", "controller.L_c[1]"),
        # Attitudes.
        (
            ORIENTATION,
            "orientation: »{deg: [0, 0, 0], quaternion: [1, 0, 0, 0]}",
            "initial.orientation",
        ),
        (ORIENTATION, "orientation: »20deg", "initial.orientation"),
        (ORIENTATION, "orientation: {deg: »5}", "initial.orientation.deg"),
        (ORIENTATION, "orientation: {deg: [0, »x, 1]}", "initial.orientation.deg[1]"),
        (ORIENTATION, "orientation: {deg: »[0, 1]}", "initial.orientation.deg"),
        (ORIENTATION, "orientation: {quaternion: »[1, 0]}", "initial.orientation.quaternion"),
        (ORIENTATION, "orientation: »{}", "initial.orientation.deg"),
        (ORIENTATION, f"{ORIENTATION}\n  attached: »1", "initial.attached"),
        *edits(
            "initial:",
            "initial:\n  attached: true\n  position: »{}",
            "initial.position",
            "[0.1, 0, 0]",
            "[0, 0, 0]",
        ),
        # The variant, and the version. Without the variant its sections cannot be judged.
        *edits("visco-elastic", "»{}", "controller.variant", "[free]", "true", "1"),
        ("  variant: visco-elastic\n", "", "7:3 controller.variant"),
        ("visco-elastic", "»rigid\n  K_s: [1, 1, 1]", "controller.variant"),
        ("visco-elastic", "»visco\n  »K_s: 1", "controller.variant, controller.K_s"),
        *edits(
            SAMPLES,
            "samples: 11\nschema_version: »{}",
            "schema_version",
            *("3", "0", "'1'", "one", "~", "[1]", "1.5", "true"),
        ),
        (SAMPLES, "samples: 11\nelements: »{}", "elements"),
        ("title: Case", "title: Case\nschema_version: 2\nelements: »5", "elements"),
    ],
    FREE: [
        ("  K_t:", "  »anchor: origin\n  K_t:", "controller.anchor"),
    ],
    PERMANENT: [
        ("initial:", "initial:\n  »position: [0, 0, 0]", "initial.position"),
        ("initial:", "initial:\n  attached: »false", "initial.attached"),
        (SAMPLES, "samples: 11\n  coordinates: »Z", "integration.coordinates"),
    ],
    MANIFOLD: [
        *edits(
            SAMPLES,
            "samples: 11\n  drift_control: »{}",
            "integration.drift_control",
            *("5", "projektion"),
        ),
        *edits(
            SAMPLES,
            "samples: 11\n  drift_control: {}",
            "integration.drift_control.baumgarte",
            *("»{}", "{baumgarte: »-5}"),
        ),
        (
            SAMPLES,
            "samples: 11\n  drift_control: {baumgarte: 5, »rate: 1}",
            "integration.drift_control.rate",
        ),
    ],
    EMBEDDED: [
        ("  K_d: [12300, 12300, 9840]\n", "", "7:3 controller.K_d"),
    ],
    SLIDING: [
        ("K_s: [1, 2, 3]", "K_s: [1, »-2, 3]", "controller.K_s[1]"),
        ("surface: position", "surface: »velocity", "controller.surface"),
        *edits("  K_t:", "  law: »{}\n  K_t:", "controller.law", "sharp", "3"),
        ("  K_t:", "  law: {implicit: »0}\n  K_t:", "controller.law.implicit"),
        ("  K_t:", "  law: {implicit: 1, »step: 2}\n  K_t:", "controller.law.step"),
        ("  K_t:", "  law: {boundary_layer: »-1}\n  K_t:", "controller.law.boundary_layer"),
        (SAMPLES, "samples: 11\n  coordinates: »quaternion", "integration.coordinates"),
    ],
    YAML: [
        *(
            ("  strut:", f"  »{name}:", f"elements.{name}")
            for name in (
                *("Strut", "1a", "_a", "a-b", "ä", "x" * 41),
                *("anchor", "body", "connector", "gravity", "kinetic"),
            )
        ),
        ("kind: spring", "kind: »sprng", "elements.strut.kind"),
        ("    kind: spring\n", "", "5:5 elements.strut.kind"),
        ("kind: spring", "kind: »[spring]", "elements.strut.kind"),
        *(
            (f"    {key}: {value}\n", "", f"5:5 elements.strut.{key}")
            for key, value in [
                *(("point", "[0.02, 0, 0.3]"), ("anchor", "[0, 0.01, 1.4]")),
                *(("stiffness", 900), ("rest_length", 0.8)),
            ]
        ),
        (
            "    stiffness:",
            "    »stiffnes:",
            "5:5 elements.strut.stiffness, 8:5 elements.strut.stiffnes",
        ),
        ("[0, 0.01, 1.4]", "[0, »x, 1.4]", "elements.strut.anchor[1]"),
        ("rest_length: 0.8", "rest_length: »-1", "elements.strut.rest_length"),
        (UPRIGHT, "{kind: guard, method: »clip}", "elements.upright.method"),
        (UPRIGHT, "»{kind: guard, couple: 1}", "elements.upright.method"),
        (UPRIGHT, "»{}", "elements.upright.kind"),
        (UPRIGHT, "»5", "elements.upright"),
        (UPRIGHT, f"{{{STIFF}: {{deg: »'60'}}}}", ".soft_angle.deg"),
        (UPRIGHT, f"{{{STIFF}: {{deg: 60, »rad: 1}}}}", ".soft_angle.rad"),
        (UPRIGHT, "{kind: guard, method: repelling, couple: »0, soft_angle: 1}", ".couple"),
        (UPRIGHT, f"{{{STOP}: 1, »soft_angle: 0.2}}", ".soft_angle"),
        (UPRIGHT, "»{kind: input}", "elements.upright.quantity"),
        (UPRIGHT, "{kind: input, quantity: »forc}", "elements.upright.quantity"),
        (
            UPRIGHT,
            "»{kind: input, quantity: couple, direction: [0, 0, 1], amplitude: ».nan, »point: 0}",
            ".signal, .amplitude, .point",
        ),
        (UPRIGHT, f"{{{LOAD}: »sine}}", "elements.upright.signal"),
        (
            UPRIGHT,
            f"{{{LOAD}: »{{kind: pulse, »strt: 1, duration: »0}}}}",
            ".signal.start, .signal.strt, .signal.duration",
        ),
        (
            UPRIGHT,
            f"{{{LOAD}: {{kind: noise, seed: »1.5, rate: 5, correlation_time: 1}}}}",
            ".signal.seed",
        ),
        ("schema_version: 2", "schema_version: 1", "1:1 controller, 4:3 elements"),
        ("elements:", "controller: »5\nelements:", "controller"),
        ("elements:", "controller: »~\nelements:", "controller"),
        (
            "elements:",
            "controller: {variant: none, »K_t: [1, 1, 1]}\nelements:",
            "controller.K_t",
        ),
    ],
}


# What JSON Schema cannot state.
ONLY_THE_PROGRAM = {
    VISCO_ELASTIC: [
        (MASS, f"{MASS}\n  »{MASS}", "body.mass"),
        ("title: Case", 'title: Case\n»"title": Other', "title"),
        ("title: Case", 'title: »"a\\0b"', "title"),
        *edits(MASS, "mass: »{}", "body.mass", ".nan", "1e999"),
        (DURATION, "duration: ».inf", "integration.duration"),
        *edits(
            *(SAMPLES, "samples: 11\nbound: {couple: 1, tilt: »{}}", "bound.tilt"),
            *("1.5708", "0", "{deg: 90}"),
        ),
        (SAMPLES, "samples: 11\n  rtol: »1e-14", "integration.rtol"),
        (SAMPLES, "samples: 11\n  coordinates: quaternion", "18:3 integration"),
        # The last ones are singular: the computed eigenvalue is round-off, of either sign.
        *edits(
            INERTIA,
            "inertia: »{}",
            "body.inertia",
            "[[1, 2, 0], [0, 9, 0], [0, 0, 1]]",
            "[[1, 0, 0.1], [0, 1, 0], [0.1000000000011, 0, 1]]",
            "[[1, 2, 0], [2, 1, 0], [0, 0, 1]]",
            "[[1, 1, 1], [1, 1, 1], [1, 1, 1]]",
            "[[0.41, 0.42, 0.49], [0.42, 0.45, 0.57], [0.49, 0.57, 0.82]]",
            "[[0.97, -0.13, -0.16], [-0.13, 0.89, 0.6], [-0.16, 0.6, 0.41]]",
        ),
        *edits(
            "K_t: [4100, 4100, 3280]",
            "K_t: {}\n  anchor: »equilibrium",
            "controller.anchor",
            *("0", "[1, 1, 0]", "[[1, 1, 0], [1, 1, 0], [0, 0, 1]]"),
        ),
        # At θ2 = ±90° B(Θ) is singular.
        *edits(
            ORIENTATION,
            "orientation: »{}",
            "initial.orientation",
            "[0, -1.6, 0]",
            "[3.15, 0, 0]",
            "[0, 1.5707963267948966, 0]",
            "{deg: [0, 90, 0]}",
            "{deg: [0, 89.99, 0]}",
            "{quaternion: [1, 0, 1, 0]}",
            "{quaternion: [0.7071, 0, 0.7071, 0]}",
            "{matrix: [[0, 1, 0], [1, 0, 0], [0, 0, 1]]}",
            "{matrix: [[1, 0, 0], [0, 1, 0], [0, 0.1, 1]]}",
        ),
        (ORIENTATION, "orientation: [0, ».nan, 0]", "initial.orientation[1]"),
    ],
    PERMANENT: [
        (SAMPLES, "samples: 11\n  drift_control: »projection", "integration.drift_control"),
        (SAMPLES, "samples: 11\n  coordinates: quaternion", "16:3 integration"),
    ],
    MANIFOLD: [
        (
            SAMPLES,
            "samples: 11\n  method: LSODA\n  drift_control: »projection",
            "integration.drift_control",
        ),
    ],
    SLIDING: [
        ("position", "{slope: 20}\n  stick_energy: »1", "controller.stick_energy"),
        (
            "  K_t:",
            "  stick_energy: »1\n  law: {implicit: 1}\n  K_t:",
            "controller.stick_energy",
        ),
    ],
    YAML: [
        ("  strut:", '  »"a\\n":', "elements.a\\n"),
        ("L: [60, 60, 42]", "L: »[[1, 2, 0], [2, 1, 0], [0, 0, 1]]", "elements.upright.L"),
        (
            UPRIGHT,
            "{kind: input, quantity: couple, direction: »[0, 0, 0], amplitude: 1, "
            "signal: {kind: constant}}",
            ".direction",
        ),
        *edits(UPRIGHT, f"{{{STIFF}: »{{}}}}", ".soft_angle", "0", "-0.3", "1.6", "{deg: 95}"),
        *edits(UPRIGHT, f"{{{STOP}: »{{}}}}", ".restitution", "1.01", "-0.1"),
        (UPRIGHT, "{kind: guard, method: stop, angle: »1.6, restitution: 1}", ".angle"),
        (UPRIGHT, f"{{{LOAD}: »{{kind: table}}}}", ".signal.times"),
        (UPRIGHT, f"{TABLE}, times: »[0, 2, 1], values: [1, 1, 1]}}}}", ".signal.times"),
        (UPRIGHT, f"{TABLE}, times: [0, 2], values: »[1]}}}}", ".signal.values"),
        (UPRIGHT, f"{TABLE}, file: »none.csv}}}}", ".signal.file"),
        ("elements:\n", f"elements:\n  »b: {{{STOP}: 1}}\n  c: {{{STOP}: 1}}\n", "elements"),
        # What elements do not fit.
        (END, f"{{{LINE}}}\nintegration: »{{duration: 2, method: LSODA}}", "integration"),
        (END, f"{{{NOISE}}}\nintegration: »{{duration: 1.0e+5}}", "integration"),
        (END, f"{{{STOP}: 1}}\n  soft: {{{STIFF}: 0.3}}{DURATION_ALONE}", "4:3 elements"),
        *(
            (END, f"{{{STOP}: 1}}\ninitial: »{{orientation: [2, {pitch}, 2]}}{DURATION_ALONE}", key)
            for pitch, key in [(0.301, "initial"), (-0.301, "initial")]
        ),
        (
            END,
            f"{{{STOP}: »x}}\ninitial: {{orientation: [0, »y, 0]}}{DURATION_ALONE}",
            ".restitution, initial.orientation[1]",
        ),
    ],
    PROJECTED: [("title: Case", f"elements: {{a: {{{LINE}}}}}", "16:3 integration")],
    IMPLICIT: [("title: Case", f"elements: »{{a: {{{LINE}}}}}", "elements")],
}


def rows(tables):
    """Return the rows of tables by their texts."""
    return [(text, *row) for table in tables for text, edits in table.items() for row in edits]


def marked(text):
    """Return a text without its marks, and the places of the marks."""
    first, *parts = text.split("»")
    places = []
    for part in parts:
        before = first.split("\n")
        places.append(f"{len(before)}:{len(before[-1]) + 1}")
        first += part
    return first, places


@pytest.mark.parametrize(("text", "old", "new", "keys"), rows([KEYS, ONLY_THE_PROGRAM]))
def test_each_problem_is_told_with_its_place_and_its_key(complaints, text, old, new, keys):
    wrong, places = marked(edited(old, new, text))
    told = [" ".join(message.split(": ")[:2]) for message in complaints(wrong)]
    expected = keys.split(", ")
    if not expected[0][0].isdigit():
        expected = [f"{place} {key}" for place, key in zip(places, expected, strict=True)]
    assert [entry.replace(" .", " elements.upright.") for entry in expected] == told


@pytest.fixture(scope="module")
def validator():
    return validator_of(json_schema())


@pytest.mark.parametrize(("text", "old", "new", "keys"), rows([KEYS]))
def test_the_schema_for_editors_refuses_it_too(validator, text, old, new, keys):
    assert schema_errors(validator, marked(edited(old, new, text))[0])
