"""Wrong configs are refused with all their problems at once, each with its place and its key."""

import pytest
from support.config_elements import YAML
from support.configs import EMBEDDED, FREE, PERMANENT, VISCO_ELASTIC, edited
from support.json_schemas import schema_errors, validator_of

from rbstab.config.schema import json_schema

SLIDING = edited(
    "  K_c: [12300, 12300, 9840]\n  L_c: [600, 600, 420]\n",
    "  K_s: [1, 2, 3]\n  surface: position\n",
    edited("visco-elastic", "sliding"),
)
MANIFOLD = edited("samples: 11", "samples: 11\n  coordinates: manifold", PERMANENT)
VARIANTS = "expected one of free, permanent, visco-elastic, embedded, sliding"
KINDS = (
    "(expected one of spring, visco-elastic, embedded, sliding, attitude, ligament, python, guard, "
    "input)"
)

MASS, INERTIA, POINT = "mass: 41.0", "inertia: [10.0, 8.0, 0.4]", "[0.15, 0.10, -0.42]"
ORIENTATION, DURATION, SAMPLES = "orientation: [0, 0, 0]", "duration: 2.0", "samples: 11"

VERSION = "samples: 11\nschema_version: {}"
BOTH = "{deg: [0, 0, 0], quaternion: [1, 0, 0, 0]}"


def edits(old, new, places, *values):
    """Return edits that put some values into a text, all with problems at the same places."""
    return [(old, new.replace("{}", value), places) for value in values]


# An edit of a config, and the place and the key of each of its problems: the JSON Schema for
# editors refuses it as well.
PLACES = {
    VISCO_ELASTIC: [
        # Keys: unknown, missing, repeated, or of another variant.
        ("title:", "titel:", "1:1 titel"),
        ("initial:", "Initial:", "14:1 Initial"),
        (SAMPLES, "samples: 11\n  qqq: 1", "20:3 integration.qqq"),
        (SAMPLES, "samples: 11\nnull: red", "20:1 null"),
        (SAMPLES, "samples: 11\n<matrix>: red", "20:1 <matrix>"),
        ("  K_t:", "  diagonal: 1\n  K_t:", "8:3 controller.diagonal"),
        ("  K_t:", "  K_d: [1, 1, 1]\n  K_t:", "8:3 controller.K_d"),
        ("initial:", "initial:\n  connector_state: [0, 0, 0]", "15:3 initial.connector_state"),
        (SAMPLES, "samples: 11\n  drift_control: none", "20:3 integration.drift_control"),
        ("  mass: 41.0\n", "", "3:3 body.mass"),
        ("visco-elastic", "embedded", "7:3 controller.K_d, 7:3 controller.L_d"),
        (SAMPLES, "samples: 11\nreference: {}", "20:12 reference.source"),
        # Sections that are no mapping.
        (
            "controller:\n  variant:",
            "controller: 5\nmore:\n  variant:",
            "6:13 controller, 7:1 more",
        ),
        (SAMPLES, "samples: 11\nreference: paper", "20:12 reference"),
        # Numbers.
        *edits(MASS, "mass: {}", "3:9 body.mass", "-1", "0", "true", "'41'", "41 kg", "4,1"),
        *edits(MASS, "mass: {}", "3:9 body.mass", "[41.0]", "{}", "~"),
        (MASS, "mass:", "3:8 body.mass"),
        *edits(DURATION, "duration: {}", "18:13 integration.duration", "0", "-1"),
        *edits(SAMPLES, "samples: {}", "19:12 integration.samples", "1", "true", "11.5", "'11'"),
        (SAMPLES, "samples: 1000001", "19:12 integration.samples"),
        (SAMPLES, "samples: 11\n  rtol: 1e-17", "20:9 integration.rtol"),
        (SAMPLES, "samples: 11\n  step_limit: 1.5", "20:15 integration.step_limit"),
        (SAMPLES, "samples: 11\n  coordinates: manifold", "20:16 integration.coordinates"),
        # Texts.
        ("title: Case", "title: 5", "1:8 title"),
        # Vectors.
        (POINT, "[1, 2]", "5:18 body.contact_point"),
        (POINT, "[]", "5:18 body.contact_point"),
        (POINT, "0.15 0.1 -0.42", "5:18 body.contact_point"),
        (POINT, "{deg: [0, 0, 0]}", "5:18 body.contact_point"),
        (POINT, "[.inf, 2, x]", "5:19 body.contact_point[0], 5:28 body.contact_point[2]"),
        (POINT, "[1, [2], true]", "5:22 body.contact_point[1], 5:27 body.contact_point[2]"),
        (POINT, "\n    - 1\n    - 2\n    - z", "8:7 body.contact_point[2]"),
        # Matrices.
        (INERTIA, "inertia: [1, 2, 3, 4]", "4:12 body.inertia"),
        (INERTIA, "inertia: [0, 1, 1]", "4:13 body.inertia[0]"),
        (INERTIA, "inertia: 5", "4:12 body.inertia"),
        (INERTIA, "inertia: [[1, 0, 0]]", "4:12 body.inertia"),
        (INERTIA, "inertia: [[1, 0, 0], [0, 1], 1]", "4:24 body.inertia[1], 4:32 body.inertia[2]"),
        (INERTIA, "inertia: [[1, 0, 0], [0, x, 0], [0, 0, 1]]", "4:28 body.inertia[1][1]"),
        ("L_r: [60, 60, 42]", "L_r: [1, 2, -3]", "11:15 controller.L_r[2]"),
        ("L_c: [600, 600, 420]", "L_c: [600, 0, 420]", "13:14 controller.L_c[1]"),
        # Attitudes.
        *edits(ORIENTATION, "orientation: {}", "15:16 initial.orientation", BOTH, "20deg"),
        (ORIENTATION, "orientation: {deg: 5}", "15:22 initial.orientation.deg"),
        (ORIENTATION, "orientation: {deg: [0, x, 1]}", "15:26 initial.orientation.deg[1]"),
        (ORIENTATION, "orientation: {quaternion: [1, 0]}", "15:29 initial.orientation.quaternion"),
        (ORIENTATION, "orientation: {}", "15:16 initial.orientation.deg"),
        (ORIENTATION, f"{ORIENTATION}\n  attached: 1", "16:13 initial.attached"),
        # The variant, and the version. Without the variant its sections cannot be judged.
        *edits("visco-elastic", "{}", "7:12 controller.variant", "[free]", "true", "1"),
        ("  variant: visco-elastic\n", "", "7:3 controller.variant"),
        ("visco-elastic", "rigid\n  K_s: [1, 1, 1]", "7:12 controller.variant"),
        ("visco-elastic", "visco\n  K_s: 1", "7:12 controller.variant, 8:3 controller.K_s"),
        *edits(SAMPLES, VERSION, "20:17 schema_version", "3", "0", "'1'", "one", "~", "[1]"),
        *edits(SAMPLES, VERSION, "20:17 schema_version", "1.5", "true"),
        (SAMPLES, "samples: 11\nelements: {}", "20:11 elements"),
        ("title: Case", "title: Case\nschema_version: 2\nelements: 5", "3:11 elements"),
    ],
    FREE: [
        ("  K_t:", "  anchor: origin\n  K_t:", "8:3 controller.anchor"),
    ],
    PERMANENT: [
        ("initial:", "initial:\n  position: [0, 0, 0]", "13:3 initial.position"),
        ("initial:", "initial:\n  attached: false", "13:13 initial.attached"),
        (SAMPLES, "samples: 11\n  coordinates: Z", "18:16 integration.coordinates"),
    ],
    MANIFOLD: [
        (
            SAMPLES,
            f"samples: 11\n  drift_control: {control}",
            f"18:{column} integration.drift_control{key}",
        )
        for control, column, key in [
            ("5", 18, ""),
            ("projektion", 18, ""),
            ("{}", 18, ".baumgarte"),
            ("{baumgarte: -5}", 30, ".baumgarte"),
            ("{baumgarte: 5, rate: 1}", 33, ".rate"),
        ]
    ],
    EMBEDDED: [
        ("  K_d: [12300, 12300, 9840]\n", "", "7:3 controller.K_d"),
    ],
    SLIDING: [
        ("K_s: [1, 2, 3]", "K_s: [1, -2, 3]", "12:12 controller.K_s[1]"),
        ("surface: position", "surface: velocity", "13:12 controller.surface"),
        *(
            ("  K_t:", f"  law: {law}\n  K_t:", f"8:{column} controller.law{key}")
            for law, column, key in [
                ("sharp", 8, ""),
                ("3", 8, ""),
                ("{implicit: 0}", 19, ".implicit"),
                ("{implicit: 1, step: 2}", 22, ".step"),
                ("{boundary_layer: -1}", 25, ".boundary_layer"),
            ]
        ),
    ],
    YAML: [
        ("  strut:", "  Strut:", "4:3 elements.Strut"),
        ("  strut:", "  connector:", "4:3 elements.connector"),
        ("kind: spring", "kind: sprng", "5:11 elements.strut.kind"),
        ("    kind: spring\n", "", "5:5 elements.strut.kind"),
        ("kind: spring", "kind: [spring]", "5:11 elements.strut.kind"),
        (
            "    stiffness:",
            "    stiffnes:",
            "5:5 elements.strut.stiffness, 8:5 elements.strut.stiffnes",
        ),
        ("[0, 0.01, 1.4]", "[0, x, 1.4]", "7:17 elements.strut.anchor[1]"),
        ("rest_length: 0.8", "rest_length: -1", "9:18 elements.strut.rest_length"),
        (
            "  upright: {kind: attitude",
            "  upright: {kind: guard, method: clip",
            "10:34 elements.upright.method",
        ),
        (
            "{kind: attitude, K: [400, 400, 320], L: [60, 60, 42]}",
            "{}",
            "10:12 elements.upright.kind",
        ),
        ("{kind: attitude, K: [400, 400, 320], L: [60, 60, 42]}", "5", "10:12 elements.upright"),
        ("schema_version: 2", "schema_version: 1", "1:1 controller, 4:3 elements"),
    ],
}


# What JSON Schema cannot state.
ONLY_THE_PROGRAM = {
    VISCO_ELASTIC: [
        (MASS, f"{MASS}\n  {MASS}", "4:3 body.mass"),
        ("title: Case", 'title: Case\n"title": Other', "2:1 title"),
        ("title: Case", 'title: "a\\0b"', "1:8 title"),
        *edits(MASS, "mass: {}", "3:9 body.mass", ".nan", "1e999"),
        (DURATION, "duration: .inf", "18:13 integration.duration"),
        (SAMPLES, "samples: 11\n  rtol: 1e-14", "20:9 integration.rtol"),
        (SAMPLES, "samples: 11\n  coordinates: quaternion", "18:3 integration"),
        # The last ones are singular: the computed eigenvalue is round-off, of either sign.
        *edits(
            INERTIA,
            "inertia: {}",
            "4:12 body.inertia",
            "[[1, 2, 0], [0, 9, 0], [0, 0, 1]]",
            "[[1, 0, 0.1], [0, 1, 0], [0.1000000000011, 0, 1]]",
            "[[1, 2, 0], [2, 1, 0], [0, 0, 1]]",
            "[[1, 1, 1], [1, 1, 1], [1, 1, 1]]",
            "[[0.41, 0.42, 0.49], [0.42, 0.45, 0.57], [0.49, 0.57, 0.82]]",
            "[[0.97, -0.13, -0.16], [-0.13, 0.89, 0.6], [-0.16, 0.6, 0.41]]",
        ),
        ("K_t: [4100, 4100, 3280]", "K_t: 0\n  anchor: equilibrium", "9:11 controller.anchor"),
        # At θ2 = ±90° B(Θ) is singular.
        *edits(
            ORIENTATION,
            "orientation: {}",
            "15:16 initial.orientation",
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
        (ORIENTATION, "orientation: [0, .nan, 0]", "15:20 initial.orientation[1]"),
    ],
    PERMANENT: [
        (SAMPLES, "samples: 11\n  drift_control: projection", "18:18 integration.drift_control"),
    ],
    MANIFOLD: [
        (
            SAMPLES,
            "samples: 11\n  method: LSODA\n  drift_control: projection",
            "19:18 integration.drift_control",
        ),
    ],
    SLIDING: [
        ("position", "{slope: 20}\n  stick_energy: 1", "14:17 controller.stick_energy"),
        (
            "  K_t:",
            "  stick_energy: 1\n  law: {implicit: 1}\n  K_t:",
            "8:17 controller.stick_energy",
        ),
    ],
    YAML: [
        ("L: [60, 60, 42]", "L: [[1, 2, 0], [2, 1, 0], [0, 0, 1]]", "10:52 elements.upright.L"),
    ],
}


def rows(tables):
    """Return the rows of tables by their texts."""
    return [(text, *row) for table in tables for text, edits in table.items() for row in edits]


@pytest.mark.parametrize(("text", "old", "new", "places"), rows([PLACES, ONLY_THE_PROGRAM]))
def test_the_place_and_the_key_of_each_problem(complaints, text, old, new, places):
    found = [message.split(": ")[:2] for message in complaints(edited(old, new, text))]
    assert ", ".join(f"{place} {key}" for place, key in found) == places


@pytest.fixture(scope="module")
def validator():
    return validator_of(json_schema())


@pytest.mark.parametrize(("text", "old", "new", "places"), rows([PLACES]))
def test_the_schema_for_editors_refuses_it(validator, text, old, new, places):
    assert schema_errors(validator, edited(old, new, text)), places


# An edit of the visco-elastic config, and its whole message.
TEXTS = [
    ("  K_t:", "  Kt:", "8:3: controller.Kt: is unknown (did you mean K_t?)"),
    ("initial:", "INITIAL:", "14:1: INITIAL: is unknown (did you mean initial?)"),
    (
        MASS,
        f"{MASS}\n  colour: 1",
        "4:3: body.colour: is unknown (expected one of mass, inertia, contact_point)",
    ),
    (SAMPLES, "samples: 11\nmass: 3", "20:1: mass: is unknown (did you mean body.mass?)"),
    (
        SAMPLES,
        "samples: 11\nslope: 1",
        "20:1: slope: is unknown (did you mean controller.surface.slope?)",
    ),
    (
        "  K_t:",
        "  K_d: [1, 1, 1]\n  K_t:",
        "8:3: controller.K_d: is not a key of the variant visco-elastic (it belongs to embedded)",
    ),
    ("  mass: 41.0\n", "", "3:3: body.mass: is missing (it is required)"),
    (
        MASS,
        f"{MASS}\n  {MASS}",
        "4:3: body.mass: is given twice, first in line 3 (expected each key once)",
    ),
    (MASS, "mass: -1", "3:9: body.mass: is -1 (expected a number greater than 0)"),
    (MASS, "mass: -.Inf", "3:9: body.mass: is -inf (expected a finite number)"),
    (MASS, "mass: False", "3:9: body.mass: is false (expected a number)"),
    (MASS, "mass: ~", "3:9: body.mass: is empty (expected a number)"),
    (MASS, "mass: {}", "3:9: body.mass: is a mapping (expected a number)"),
    (MASS, f"mass: {'x' * 41}", f"3:9: body.mass: is the text '{'x' * 37}...' (expected a number)"),
    (SAMPLES, "samples: 1.5", "19:12: integration.samples: is 1.5 (expected a whole number)"),
    (SAMPLES, "samples: 1", "19:12: integration.samples: is 1 (expected a number at least 2)"),
    (
        SAMPLES,
        "samples: 2000001",
        "19:12: integration.samples: is 2000001 (expected a number at most 1000000)",
    ),
    (
        SAMPLES,
        f"samples: -1{'0' * 15}",
        "19:12: integration.samples: is a whole number of more than 15 digits (expected a number "
        "at least 2)",
    ),
    (
        SAMPLES,
        "samples: 11\n  engine: Scipy",
        "20:11: integration.engine: is the text 'Scipy' (expected scipy or heyoka; did you mean "
        "scipy?)",
    ),
    (
        DURATION,
        "duration: 9e-100",
        "19:12: integration.samples: 11 samples in 9e-100 s are too close (expected at least "
        "1e-100 s between samples)",
    ),
    (POINT, "[1, 2]", "5:18: body.contact_point: has 2 entries (expected 3)"),
    (POINT, "0.15", "5:18: body.contact_point: is 0.15 (expected a list of 3)"),
    (INERTIA, "inertia: 5", "4:12: body.inertia: is 5 (expected three numbers or a 3x3 matrix)"),
    (
        INERTIA,
        "inertia: [[1, 2, 0], [0, 9, 0], [0, 0, 1]]",
        "4:12: body.inertia: is not symmetric (expected a symmetric matrix)",
    ),
    (
        "L_r: [60, 60, 42]",
        "L_r: [[1, 2, 0], [2, 1, 0], [0, 0, 1]]",
        "11:8: controller.L_r: is not positive semidefinite, its smallest eigenvalue is -1 "
        "(expected no negative eigenvalue)",
    ),
    ("title: Case", 'title: ""', "1:8: title: is empty (expected a text)"),
    (
        "title: Case",
        f"title: {'x' * 201}",
        "1:8: title: has 201 characters (expected at most 200 characters)",
    ),
    (SAMPLES, "samples: 11\nreference: 5", "20:12: reference: is 5 (expected a mapping)"),
    (
        ORIENTATION,
        "orientation: {deg: [90, 100, -181]}",
        "15:16: initial.orientation: θ2 = 1.74533 rad (100°), θ3 = -3.15905 rad (-181°) are "
        "outside the range of "
        "eq. 5 (expected θ1 and θ3 between ±180°, θ2 inside of ±90°; degrees are {deg: [...]})",
    ),
    (
        ORIENTATION,
        "orientation: {deg: [0, 89.99, 0]}",
        "15:16: initial.orientation: has cos θ2 = 0.00017, and a run ends where it is 0.001 or "
        "less (expected |θ2| "
        "below 89.9427°, or a smaller integration.range_bound)",
    ),
    (
        ORIENTATION,
        "orientation: 20deg",
        "15:16: initial.orientation: is the text '20deg' (expected a list of 3, or {deg: [0, 20, "
        "0]})",
    ),
    (
        "visco-elastic",
        "Visco Elastic",
        f"7:12: controller.variant: is the text 'Visco Elastic' ({VARIANTS}; did you mean "
        "visco-elastic?)",
    ),
    (
        SAMPLES,
        "samples: 11\nschema_version: 3",
        "20:17: schema_version: is 3, which this version of rbstab cannot read (expected 1 or 2)",
    ),
    (
        SAMPLES,
        "samples: 11\nelements: {}",
        "20:11: elements: is not a key of schema version 1 (expected schema_version: 2)",
    ),
    (
        "title: Case",
        "schema_version: 2\nelements: {a: {kind: sprng}}",
        f"2:22: elements.a.kind: is the text 'sprng' {KINDS[:-1]}; did you mean spring?)",
    ),
    (
        "title: Case",
        "schema_version: 2\nelements: {a: {}}",
        f"2:15: elements.a.kind: is missing {KINDS}",
    ),
    (
        "title: Case",
        "schema_version: 2\nelements: {A: {kind: attitude, K: [1, 1, 1], L: [1, 1, 1]}}",
        "2:12: elements.A: is not a name of an element (expected a lower-case letter, then up to "
        "39 lower-case "
        "letters, digits or _)",
    ),
]


@pytest.mark.parametrize(("old", "new", "message"), TEXTS)
def test_whole_messages(complaints, old, new, message):
    assert complaints(edited(old, new)) == [message]


MANY = """\
title: ""
body:
  mass: -1
  inertia: [10, 8]
  contact_point: [0, x, 0]
  mass: 2
controller:
  variant: visco-elastic
  K_t: [[1, 2, 0], [2, 1, 0], [0, 0, 1]]
  L_t: [1, 1, 1]
  K_r: &a [1, 1, 1]
  L_r: *a
  Kc: [1, 1, 1]
  L_c: [1, 1, 1]
  L_d: [1, 1, 1]
initial:
  orientation: [0, 90, 0]
integration:
  duration: .inf
  samples: 1
  coordinates: w
elements:
  b: {}
  d: {kind: guard, method: repelling, stiffness: 1.0, soft_angle: 1.6}
  s: {kind: input, quantity: force, point: [0, 0, 0], direction: [0, 0, 0], amplitude: 1, signal: 1}
schema_version: 3
"""


def test_all_problems_at_once_in_the_order_of_their_places(complaints):
    assert [" ".join(message.split(": ")[:2]) for message in complaints(MANY)] == [
        "1:8 title",
        "3:9 body.mass",
        "4:12 body.inertia",
        "5:22 body.contact_point[1]",
        "6:3 body.mass",
        "8:3 controller.K_c",
        "9:8 controller.K_t",
        "11:8 controller.K_r",
        "12:8 controller.L_r",
        "13:3 controller.Kc",
        "15:3 controller.L_d",
        "17:16 initial.orientation",
        "19:13 integration.duration",
        "20:12 integration.samples",
        "21:16 integration.coordinates",
        "23:6 elements.b.kind",
        "24:6 elements.d.couple",
        "24:39 elements.d.stiffness",
        "24:67 elements.d.soft_angle",
        "25:66 elements.s.direction",
        "25:99 elements.s.signal",
        "26:17 schema_version",
    ]


def test_a_key_of_the_controller_where_elements_hold_the_body(complaints):
    found = complaints("schema_version: 2\n" + edited("visco-elastic", "none"))
    assert len(found) == 6
    assert found[0].endswith("embedded, sliding; here, `elements` hold the body)")


def test_a_repeated_section_is_not_called_incomplete_where_it_is_complete(complaints):
    found = complaints(VISCO_ELASTIC + "body: {}\ncontroller: {}\n")
    assert [message.split(" (")[0] for message in found] == [
        "20:1: body: is given twice, first in line 2",
        "21:1: controller: is given twice, first in line 6",
    ]


@pytest.mark.parametrize("section", ["body", "controller", "integration"])
def test_a_missing_section_is_told_at_the_start_of_its_parent(complaints, section):
    begin = VISCO_ELASTIC.index(f"{section}:")
    indented = VISCO_ELASTIC[begin:].replace("\n  ", "\r")
    text = VISCO_ELASTIC[:begin] + indented.partition("\n")[2].replace("\r", "\n  ")
    assert complaints(text) == [f"1:1: {section}: is missing (it is required)"]
