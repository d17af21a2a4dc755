"""Protects the errors of invalid plans: all problems are reported at once, each with its place."""

import pytest
from support.configs import PLAN, edited

DRAWN = edited("design: grid", "design: random\nmembers: 10\nseed: 1", PLAN)

LISTS = "values, linspace, logspace or geomspace"
WORDS = "values, linspace, logspace, geomspace, uniform, normal, loguniform"
FORM = f"expected a mapping of one of {WORDS}, scale, zip, each, member"
SECTIONS = "expected a key of body, gravity, controller, elements or initial"
KEEP = "expected summary, traces or {traces: [number, ...] or {every: n}}"
DESIGNS = "expected grid, random, sobol or latin-hypercube"


def test_what_is_right(load):
    assert load(PLAN).title == "Plan"
    assert load(PLAN + "schema_version: 1\n").members == 2


ROOT = [
    ("", ["1:1: base: is missing (it is required)", "1:1: vary: is missing (it is required)"]),
    ("[]", ["1:1: is a list of 0 (expected a mapping)"]),
    (edited("title:", "titel:", PLAN), ["1:1: titel: is unknown (did you mean title?)"]),
    (
        PLAN + "colour: red\n",
        [
            "7:1: colour: is unknown (expected one of schema_version, title, base, vary, design,"
            " members, seed, keep, prove)"
        ],
    ),
    (
        PLAN + "title: Other\n",
        ["7:1: title: is given twice, first in line 1 (expected each key once)"],
    ),
    (
        edited("[40, 50]", "[40, *a]", PLAN),
        ["4:28: vary.body.mass.values[1]: is the alias *a (expected values written out)"],
    ),
    (
        PLAN + "schema_version: 2\n",
        ["7:17: schema_version: is 2, which this version of rbstab does not support (expected 1)"],
    ),
    (PLAN + "schema_version: true\n", ["7:17: schema_version: is true (expected 1)"]),
    (PLAN + "schema_version: '1'\n", ["7:17: schema_version: is the text '1' (expected 1)"]),
    (edited("title: Plan", "title: 5", PLAN), ["1:8: title: is 5 (expected a text)"]),
    (edited("title: Plan", "title: ''", PLAN), ["1:8: title: is empty (expected a text)"]),
    (
        edited("title: Plan", f"title: {'x' * 201}", PLAN),
        ["1:8: title: has 201 characters (expected at most 200)"],
    ),
    (edited("grid", "cube", PLAN), [f"5:9: design: is the text 'cube' ({DESIGNS})"]),
    (edited("grid", "[grid]", PLAN), [f"5:9: design: is a list of 1 ({DESIGNS})"]),
    (
        edited("design: grid", "members: 5\nseed: 1", PLAN),
        [
            "5:1: members: has no effect in a grid (expected no members)",
            "6:1: seed: has no effect in a grid (expected no seed)",
        ],
    ),
    (
        edited("grid", "sobol", PLAN),
        [
            "1:1: members: is missing (the design sobol requires it)",
            "1:1: seed: is missing (the design sobol requires it)",
        ],
    ),
    (
        DRAWN.replace("10", "0").replace("seed: 1", "seed: -1"),
        [
            "6:10: members: is 0 (expected a number at least 1)",
            "7:7: seed: is -1 (expected a number at least 0)",
        ],
    ),
    (
        DRAWN.replace("10", "10.5").replace("seed: 1", "seed: one"),
        [
            "6:10: members: is 10.5 (expected a whole number)",
            "7:7: seed: is the text 'one' (expected a whole number)",
        ],
    ),
    (
        DRAWN.replace("{values: [40, 50]}", "{each: {values: [40, 50]}}"),
        ["5:9: design: has nothing to draw (expected a key without `each`)"],
    ),
]


@pytest.mark.parametrize(("text", "expected"), ROOT)
def test_root(complaints, text, expected):
    assert complaints(text) == expected


KEPT = [
    ("all", f"6:7: keep: 'all' is unknown ({KEEP})"),
    ("[1]", f"6:7: keep: is neither a word nor a mapping ({KEEP})"),
    ("{}", "6:7: keep.traces: is missing (it is required)"),
    ("{trace: [1]}", "6:8: keep.trace: is unknown (did you mean traces?)"),
    (
        "{traces: all}",
        "6:16: keep.traces: is the text 'all' (expected [number, ...] or {every: n})",
    ),
    ("{traces: {}}", "6:16: keep.traces.every: is missing (it is required)"),
    ("{traces: {every: 0}}", "6:24: keep.traces.every: is 0 (expected a number at least 1)"),
    (
        "{traces: {every: 2, other: 1}}",
        "6:27: keep.traces.other: is unknown (expected one of every)",
    ),
    ("{traces: [0, 2]}", "6:20: keep.traces[1]: is 2 (expected a member below 2)"),
    ("{traces: [-1]}", "6:17: keep.traces[0]: is -1 (expected a number at least 0)"),
    ("{traces: [0.5]}", "6:17: keep.traces[0]: is 0.5 (expected a whole number)"),
]


@pytest.mark.parametrize(("value", "expected"), KEPT)
def test_keep(complaints, value, expected):
    assert complaints(edited("keep: summary", f"keep: {value}", PLAN)) == [expected]


def test_members_that_are_kept_are_not_judged_before_it_is_known_how_many_there_are(complaints):
    text = edited("grid", "random\nseed: 1", PLAN)
    assert complaints(edited("keep: summary", "keep: {traces: [7]}", text)) == [
        "1:1: members: is missing (the design random requires it)"
    ]
    text = edited("body.mass: {values: [40, 50]}", "body.mass: {valuse: [40, 50]}", PLAN)
    assert complaints(edited("keep: summary", "keep: {traces: [1]}", text)) == [
        "4:15: vary.body.mass.valuse: is unknown (did you mean values?)"
    ]


VARY = [
    ("vary: {}", "3:7: vary: is empty (expected a mapping of keys to their values)"),
    ("vary: 5", "3:7: vary: is 5 (expected a mapping of keys to their values)"),
    ("vary: [body.mass]", "3:7: vary: is a list of 1 (expected a mapping of keys to their values)"),
]


@pytest.mark.parametrize(("line", "expected"), VARY)
def test_vary(complaints, line, expected):
    assert complaints(edited("vary:\n  body.mass: {values: [40, 50]}", line, PLAN)) == [expected]


# An entry of `vary` in line 4, and its error messages.
ENTRIES = [
    # Keys.
    (
        "body.mas: {values: [1]}",
        ["4:3: vary.body.mas: is not in the base (did you mean body.mass?)"],
    ),
    ("K_r: {values: [1]}", ["4:3: vary.K_r: cannot vary (did you mean controller.K_r?)"]),
    ("K_r[0]: {values: [1]}", ["4:3: vary.K_r[0]: cannot vary (did you mean controller.K_r[0]?)"]),
    ("mass: {values: [1]}", ["4:3: vary.mass: cannot vary (did you mean body.mass?)"]),
    ("samples: {values: [1]}", [f"4:3: vary.samples: cannot vary ({SECTIONS})"]),
    ("body.mass[: {values: [1]}", ["4:3: vary.body.mass[: cannot vary (did you mean body.mass?)"]),
    ("integration.rtol: {values: [1]}", [f"4:3: vary.integration.rtol: cannot vary ({SECTIONS})"]),
    (
        "controller.K_r: {linspace: [1, 2, 3]}",
        [
            "4:3: vary.controller.K_r: is a list of 3 in the base"
            " (expected one entry, as controller.K_r[0], or scale)"
        ],
    ),
    (
        "controller.K_r[0][0]: {values: [1]}",
        ["4:3: vary.controller.K_r[0][0]: is not in the base (did you mean controller.K_r[0]?)"],
    ),
    (
        "controller.K_d[0]: {values: [1]}",
        ["4:3: vary.controller.K_d[0]: is not in the base (did you mean controller.K_t[0]?)"],
    ),
    (
        "controller.K_t[3]: {values: [1]}",
        ["4:3: vary.controller.K_t[3]: is not in the base (did you mean controller.K_t[2]?)"],
    ),
    (
        "gravity.x.y.z.a.b: {values: [1]}",
        ["4:3: vary.gravity.x.y.z.a.b: is not in the base (expected a key of the config)"],
    ),
    (
        "controller.anchor: {values: [1]}",
        [
            "4:3: vary.controller.anchor: is the text 'origin' in the base"
            " (expected a number, or controller.variant)"
        ],
    ),
    (
        "body: {scale: {values: [2]}}",
        ["4:3: vary.body: is a mapping in the base (expected a number, a vector or a matrix)"],
    ),
    (
        "gravity: {scale: {values: [2]}}",
        [
            "4:3: vary.gravity: is zero in the base, where a scale has no effect"
            " (expected another base)"
        ],
    ),
    # Distributions.
    (
        "body.mass: 5",
        [f"4:14: vary.body.mass: is 5 ({FORM})"],
    ),
    (
        "body.mass: {}",
        [f"4:14: vary.body.mass: is empty ({FORM})"],
    ),
    (
        "body.mass: {scale: 5}",
        [f"4:22: vary.body.mass.scale: is 5 (expected a mapping of one of {WORDS})"],
    ),
    (
        "body.mass: {linspaec: [1, 2, 3]}",
        ["4:15: vary.body.mass.linspaec: is unknown (did you mean linspace?)"],
    ),
    (
        "body.mass: {values: [1], linspace: [1, 2, 3]}",
        [f"4:14: vary.body.mass: has values and linspace ({FORM})"],
    ),
    (
        "body.mass: {values: [1], scale: {values: [1]}}",
        [f"4:14: vary.body.mass: has values and scale ({FORM})"],
    ),
    ("body.mass: {values: 5}", ["4:23: vary.body.mass.values: is 5 (expected a list of values)"]),
    (
        "body.mass: {values: []}",
        ["4:23: vary.body.mass.values: is empty (expected a list of values)"],
    ),
    (
        "body.mass: {values: [1, x, true, .inf, [2]]}",
        [
            "4:27: vary.body.mass.values[1]: is the text 'x' (expected a number)",
            "4:30: vary.body.mass.values[2]: is true (expected a number)",
            "4:36: vary.body.mass.values[3]: is inf (expected a finite number)",
            "4:42: vary.body.mass.values[4]: is a list of 1 (expected a number)",
        ],
    ),
    (
        "body.mass: {linspace: 5}",
        ["4:25: vary.body.mass.linspace: is 5 (expected [first, last, count])"],
    ),
    (
        "body.mass: {linspace: [1, 2]}",
        ["4:25: vary.body.mass.linspace: has 2 entries (expected [first, last, count])"],
    ),
    (
        "body.mass: {logspace: [1]}",
        ["4:25: vary.body.mass.logspace: has 1 entry (expected [first, last, count])"],
    ),
    (
        "body.mass: {linspace: [1, x, 1.5]}",
        [
            "4:29: vary.body.mass.linspace[1]: is the text 'x' (expected a number)",
            "4:32: vary.body.mass.linspace[2]: is 1.5 (expected a whole number)",
        ],
    ),
    (
        "body.mass: {linspace: [1, 2, 0]}",
        ["4:32: vary.body.mass.linspace[2]: is 0 (expected a number at least 1)"],
    ),
    (
        "body.mass: {linspace: [-1e308, 1e308, 3]}",
        [
            "4:25: vary.body.mass.linspace: is [-1e+308, 1e+308]"
            " (expected numbers whose difference is finite)"
        ],
    ),
    (
        "body.mass: {logspace: [0, 309, 3]}",
        ["4:25: vary.body.mass.logspace: is [0, 309] (expected exponents of 10 from -308 to 308)"],
    ),
    (
        "body.mass: {geomspace: [0, 5, 3]}",
        ["4:26: vary.body.mass.geomspace: is [0, 5] (expected numbers greater than 0)"],
    ),
    (
        "body.mass: {uniform: [1, 2]}",
        [f"4:14: vary.body.mass: is not a list, which a grid requires (expected {LISTS})"],
    ),
    # The variant.
    (
        "controller.variant: {linspace: [1, 2, 3]}",
        [
            "4:23: vary.controller.variant: is not a list of variants"
            " (expected values: [variant, ...])"
        ],
    ),
    (
        "controller.variant: {scale: {values: [free]}}",
        [
            "4:23: vary.controller.variant: is not a list of variants"
            " (expected values: [variant, ...])"
        ],
    ),
    (
        "controller.variant: {values: [free, 5]}",
        [
            "4:23: vary.controller.variant: is not a list of variants"
            " (expected values: [variant, ...])"
        ],
    ),
    (
        "body.mass: {values: [40, free]}",
        ["4:14: vary.body.mass: has names of variants (expected numbers)"],
    ),
    (
        "controller.variant: {values: [free, Sliding, rigid]}",
        [
            "4:39: vary.controller.variant.values[1]: is the text 'Sliding' (expected one of free,"
            " permanent, visco-elastic, embedded, sliding; did you mean sliding?)",
            "4:48: vary.controller.variant.values[2]: is the text 'rigid'"
            " (expected one of free, permanent, visco-elastic, embedded, sliding)",
        ],
    ),
    # Groups.
    ("a: {zip: 5}", ["4:12: vary.a.zip: is 5 (expected a mapping of keys to their values)"]),
    ("a: {zip: {}}", ["4:12: vary.a.zip: is empty (expected a mapping of keys to their values)"]),
    (
        "a: {zip: {body.mass: {values: [1]}}, scale: {values: [1]}}",
        [f"4:6: vary.a: has scale and zip ({FORM})"],
    ),
    (
        "a: {zip: {body.mass: {zip: {}}, K: {each: {values: [1]}}}}",
        [
            "4:25: vary.a.zip.body.mass.zip: is nested too deeply"
            " (expected `each` outermost, and no `zip` in a `zip`)",
            "4:39: vary.a.zip.K.each: is nested too deeply"
            " (expected `each` outermost, and no `zip` in a `zip`)",
        ],
    ),
    (
        "a: {zip: {body.mass: {values: [1, 2]}, 'gravity[0]': {linspace: [1, 2, 3]}}}",
        [
            "4:56: vary.a.zip.gravity[0]: is a list of 3 where others have 2"
            " (expected lists of equal length in a zip)"
        ],
    ),
    (
        "a: {zip: {body.mass: {values: [1, 2]}, 'gravity[0]': {values: [1]}}}",
        [
            "4:56: vary.a.zip.gravity[0]: is a list of 1 where others have 2"
            " (expected lists of equal length in a zip)"
        ],
    ),
    (
        "a/b: {zip: {body.mass: {values: [1]}}}",
        ["4:3: vary.a/b: is not a valid name of a zip (expected words, but not `point`)"],
    ),
    (
        "point: {zip: {body.mass: {values: [1]}}}",
        ["4:3: vary.point: is not a valid name of a zip (expected words, but not `point`)"],
    ),
    (
        "body.mass: {each: {values: [1]}}",
        [
            "4:15: vary.body.mass.each: has no effect in a grid, which has every entry anyway"
            " (expected no `each`)"
        ],
    ),
    # A value that varies twice.
    (
        "controller.K_t[0]: {values: [1]}\n  controller.K_t: {scale: {values: [2]}}",
        [
            "5:3: vary.controller.K_t: varies the same values as controller.K_t[0]"
            " (expected each value once)"
        ],
    ),
    (
        "controller.K_t: {scale: {values: [2]}}\n  controller.K_t[0]: {values: [1]}",
        [
            "5:3: vary.controller.K_t[0]: varies the same values as controller.K_t"
            " (expected each value once)"
        ],
    ),
    (
        "a: {zip: {body.mass: {values: [1]}}}\n  body.mass: {values: [2]}",
        ["5:3: vary.body.mass: varies the same values as body.mass (expected each value once)"],
    ),
]


@pytest.mark.parametrize(("entry", "expected"), ENTRIES)
def test_entries(complaints, entry, expected):
    assert complaints(edited("body.mass: {values: [40, 50]}", entry, PLAN)) == expected


ORDERED = [
    ("uniform: [2, 2]", "uniform: is [2, 2] (expected a < b)"),
    ("uniform: [1]", "uniform: has 1 entry (expected [a, b])"),
    ("normal: [2, 0]", "normal: is [2, 0] (expected a standard deviation above 0)"),
    ("normal: 5", "normal: is 5 (expected [mean, sd])"),
    ("normal: [1e308, 1e308]", "normal: exceeds the range of numbers (expected finite values)"),
    ("loguniform: [0, 2]", "loguniform: is [0, 2] (expected 0 < a < b)"),
    ("loguniform: [3, 2]", "loguniform: is [3, 2] (expected 0 < a < b)"),
]


@pytest.mark.parametrize(("entry", "expected"), ORDERED)
def test_distributions(complaints, entry, expected):
    (message,) = complaints(edited("values: [40, 50]", entry, DRAWN))
    assert message.split(": ", 1)[1] == f"vary.body.mass.{expected}"


def test_each_needs_a_list(complaints):
    text = edited("{values: [40, 50]}", "{each: {uniform: [1, 2]}}", DRAWN)
    text = edited("design:", "  gravity[0]: {uniform: [0, 1]}\ndesign:", text)
    assert complaints(text) == [
        f"4:14: vary.body.mass: is not a list, which `each` requires (expected {LISTS})"
    ]


def test_everything_at_once(complaints):
    text = "titel: a\nbase: nowhere.yaml\nvary: {K: {values: [x]}}\ndesign: cube\nkeep: all\n"
    assert [message.split(":")[0] for message in complaints(text)] == ["1", "2", "3", "4", "5"]


def test_another_error_does_not_hide_those_of_members(complaints):
    text = edited("[40, 50]", "[-40, 50]", edited("title: Plan", "titel: Plan", PLAN))
    assert [line.partition(" (")[0] for line in complaints(text)] == [
        "1:1: titel: is unknown",
        "4:3: vary.body.mass: at member 0 body.mass is -40",
    ]


def test_more_keys_than_a_config_has(complaints):
    lines = "".join(f"  body.x{i}: {{values: [1]}}\n" for i in range(201))
    assert complaints(edited("  body.mass: {values: [40, 50]}\n", lines, PLAN)) == [
        "4:3: vary: varies 201 keys (expected at most 200)"
    ]


TOO_MANY = [
    (
        "  body.mass: {linspace: [1, 2, 100000001]}\n",
        "4:3: vary: makes 100000001 members (expected at most 100000000)",
    ),
    (
        "  body.mass: {linspace: [1, 2, 10000]}\n  gravity[0]: {linspace: [1, 2, 10001]}\n",
        "4:3: vary: makes 100010000 members (expected at most 100000000)",
    ),
    (
        "  body.mass: {linspace: [1, 2, 1000000000000]}\n"
        "  gravity[0]: {linspace: [1, 2, 1000000000000]}\n",
        "4:3: vary: makes about 10^24 members (expected at most 100000000)",
    ),
]


@pytest.mark.parametrize(("lines", "expected"), TOO_MANY)
def test_too_many_members(complaints, lines, expected):
    assert complaints(edited("  body.mass: {values: [40, 50]}\n", lines, PLAN)) == [expected]


def test_too_many_points(complaints):
    text = edited("members: 10", "members: 100000001", DRAWN)
    assert complaints(text) == ["4:3: vary: makes 100000001 members (expected at most 100000000)"]
    line = "  gravity[0]: {each: {linspace: [1, 2, 1001]}}\ndesign:"
    text = edited("members: 10", "members: 100000", edited("design:", line, DRAWN))
    assert complaints(text) == ["4:3: vary: makes 100100000 members (expected at most 100000000)"]
    text = edited("random", "latin-hypercube", edited("members: 10", "members: 2000001", DRAWN))
    assert complaints(text) == [
        "6:10: members: is 2000001, more than the design latin-hypercube allows "
        "(expected at most 2000000)"
    ]
