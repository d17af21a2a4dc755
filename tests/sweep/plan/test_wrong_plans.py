"""Protects the errors of invalid plans: all problems are reported at once, each with its place."""

import pytest
from support.configs import PLAN, edited

DRAWN = edited("design: grid", "design: random\nmembers: 10\nseed: 1", PLAN)
ENTRY = "body.mass: {values: [40, 50]}"


def places(messages):
    return ", ".join(" ".join(message.split(": ")[:2]) for message in messages)


# A plan, and the place and the key of each of its problems.
PLACES = [
    ("", "1:1 base, 1:1 vary"),
    (edited("title:", "titel:", PLAN), "1:1 titel"),
    (PLAN + "colour: red\n", "7:1 colour"),
    (PLAN + "title: Other\n", "7:1 title"),
    (edited("[40, 50]", "[40, *a]", PLAN), "4:28 vary.body.mass.values[1]"),
    (PLAN + "schema_version: 2\n", "7:17 schema_version"),
    (PLAN + "schema_version: true\n", "7:17 schema_version"),
    (edited("title: Plan", "title: 5", PLAN), "1:8 title"),
    (edited("grid", "cube", PLAN), "5:9 design"),
    (edited("grid", "[grid]", PLAN), "5:9 design"),
    (edited("design: grid", "members: 5\nseed: 1", PLAN), "5:1 members, 6:1 seed"),
    (edited("grid", "sobol", PLAN), "1:1 members, 1:1 seed"),
    (DRAWN.replace("10", "0").replace("seed: 1", "seed: -1"), "6:10 members, 7:7 seed"),
    (DRAWN.replace("10", "1.5").replace("seed: 1", "seed: a"), "6:10 members, 7:7 seed"),
    (DRAWN.replace("{values: [40, 50]}", "{each: {values: [4]}}"), "5:9 design"),
    (
        edited(
            ENTRY, "body.mass: {each: {uniform: [1, 2]}}\n  gravity[0]: {normal: [0, 1]}", DRAWN
        ),
        "4:3 vary.body.mass",
    ),
    *(
        (edited("keep: summary", f"keep: {value}", PLAN), place)
        for value, place in [
            ("all", "6:7 keep"),
            ("[1]", "6:7 keep"),
            ("{}", "6:7 keep.traces"),
            ("{trace: [1]}", "6:7 keep.traces, 6:8 keep.trace"),
            ("{traces: all}", "6:16 keep.traces"),
            ("{traces: {}}", "6:16 keep.traces.every"),
            ("{traces: {every: 0}}", "6:24 keep.traces.every"),
            ("{traces: {every: 2, other: 1}}", "6:27 keep.traces.other"),
            ("{traces: [0, 2]}", "6:16 keep.traces"),
            ("{traces: [-1]}", "6:17 keep.traces[0]"),
            ("{traces: [0.5]}", "6:17 keep.traces[0]"),
        ]
    ),
    *(
        (edited(f"vary:\n  {ENTRY}", f"vary: {value}", PLAN), "3:7 vary")
        for value in ("{}", "5", "[body.mass]")
    ),
    # Members that are kept are not judged before it is known how many there are.
    (edited("summary", "{traces: [7]}", edited("grid", "random\nseed: 1", PLAN)), "1:1 members"),
    # Everything at once: what is wrong elsewhere hides neither members nor keys.
    (
        "titel: a\nbase: nowhere.yaml\nvary: {K: {values: [x]}}\ndesign: cube\nkeep: all\n",
        "1:1 titel, 2:7 base, 3:21 vary.K.values[0], 4:9 design, 5:7 keep",
    ),
    (
        edited("[40, 50]", "[-40, 50]", edited("title:", "titel:", PLAN)),
        "1:1 titel, 4:3 vary.body.mass",
    ),
    (
        edited(
            f"  {ENTRY}\n", "".join(f"  body.x{i}: {{values: [1]}}\n" for i in range(201)), PLAN
        ),
        "4:3 vary",
    ),
    *(
        (
            edited(
                ENTRY,
                f"body.mass: {{linspace: [1, 2, {n}]}}\n  gravity[0]: {{linspace: [0, 1, {m}]}}",
                PLAN,
            ),
            "4:3 vary",
        )
        for n, m in [(10**4, 10**4 + 1), (10**12, 10**12)]
    ),
    (edited("members: 10", "members: 100000001", DRAWN), "4:3 vary"),
    (
        edited(
            "members: 10",
            "members: 100000\nkeep: traces",
            edited(
                "keep: summary\n",
                "",
                edited(
                    ENTRY, f"{ENTRY}\n  gravity[0]: {{each: {{linspace: [1, 2, 1001]}}}}", DRAWN
                ),
            ),
        ),
        "4:3 vary",
    ),
    (
        edited("random", "latin-hypercube", edited("members: 10", "members: 2000001", DRAWN)),
        "6:10 members",
    ),
]


@pytest.mark.parametrize(("text", "expected"), PLACES)
def test_places(complaints, text, expected):
    assert places(complaints(text)) == expected


LIST = "a: {zip: {body.mass: {values: [1, 2]}, 'gravity[0]': %s}}"

# An entry of `vary` in line 4, and the place and the key of each of its problems below `vary`.
ENTRIES = [
    ("body.mas: {values: [1]}", "4:3 body.mas"),
    ("K_r[0]: {values: [1]}", "4:3 K_r[0]"),
    ("body.mass[: {values: [1]}", "4:3 body.mass["),
    ("integration.rtol: {values: [1]}", "4:3 integration.rtol"),
    ("controller.K_r: {linspace: [1, 2, 3]}", "4:3 controller.K_r"),
    ("controller.K_d[0]: {values: [1]}", "4:3 controller.K_d[0]"),
    ("gravity.x.y.z.a.b: {values: [1]}", "4:3 gravity.x.y.z.a.b"),
    ("controller.anchor: {values: [1]}", "4:3 controller.anchor"),
    ("body: {scale: {values: [2]}}", "4:3 body"),
    ("gravity: {scale: {values: [2]}}", "4:3 gravity"),
    # Distributions.
    ("body.mass: 5", "4:14 body.mass"),
    ("body.mass: {}", "4:14 body.mass"),
    ("body.mass: {scale: 5}", "4:22 body.mass.scale"),
    ("body.mass: {linspaec: [1, 2, 3]}", "4:15 body.mass.linspaec"),
    ("body.mass: {values: [1], linspace: [1, 2, 3]}", "4:14 body.mass"),
    ("body.mass: {values: [1], scale: {values: [1]}}", "4:14 body.mass"),
    ("body.mass: {values: 5}", "4:23 body.mass.values"),
    ("body.mass: {values: []}", "4:23 body.mass.values"),
    (
        "body.mass: {values: [1, x, true, .inf, [2]]}",
        "4:27 body.mass.values[1], 4:30 body.mass.values[2], 4:36 body.mass.values[3], "
        "4:42 body.mass.values[4]",
    ),
    ("body.mass: {linspace: [1, 2]}", "4:25 body.mass.linspace"),
    (
        "body.mass: {linspace: [1, x, 1.5]}",
        "4:29 body.mass.linspace[1], 4:32 body.mass.linspace[2]",
    ),
    ("body.mass: {linspace: [1, 2, 0]}", "4:32 body.mass.linspace[2]"),
    ("body.mass: {linspace: [-1e308, 1e308, 3]}", "4:25 body.mass.linspace"),
    ("body.mass: {logspace: [0, 309, 3]}", "4:25 body.mass.logspace"),
    ("body.mass: {geomspace: [0, 5, 3]}", "4:26 body.mass.geomspace"),
    ("body.mass: {uniform: [1, 2]}", "4:3 body.mass"),
    # The variant.
    ("controller.variant: {linspace: [1, 2, 3]}", "4:3 controller.variant"),
    ("controller.variant: {scale: {values: [free]}}", "4:3 controller.variant"),
    ("controller.variant: {values: [free, 5]}", "4:3 controller.variant"),
    ("body.mass: {values: [40, free]}", "4:3 body.mass"),
    ("controller.variant: {values: [free, Sliding]}", "4:39 controller.variant.values[1]"),
    # Groups.
    ("a: {zip: 5}", "4:12 a.zip"),
    ("a: {zip: {}}", "4:12 a.zip"),
    ("a: {zip: {body.mass: {values: [1]}}, scale: {values: [1]}}", "4:6 a"),
    (
        "a: {zip: {body.mass: {zip: {}}, K: {each: {values: [1]}}}}",
        "4:25 a.zip.body.mass.zip, 4:39 a.zip.K.each",
    ),
    (LIST % "{linspace: [1, 2, 3]}", "4:42 a.zip.gravity[0]"),
    (LIST % "{values: [1]}", "4:42 a.zip.gravity[0]"),
    ("a/b: {zip: {body.mass: {values: [1]}}}", "4:3 a/b"),
    ("point: {zip: {body.mass: {values: [1]}}}", "4:3 point"),
    ("body.mass: {each: {values: [1]}}", "4:15 body.mass.each"),
    # A value that varies twice.
    (
        "controller.K_t[0]: {values: [1]}\n  controller.K_t: {scale: {values: [2]}}",
        "5:3 controller.K_t",
    ),
    (
        "controller.K_t: {scale: {values: [2]}}\n  controller.K_t[0]: {values: [1]}",
        "5:3 controller.K_t[0]",
    ),
    ("a: {zip: {body.mass: {values: [1]}}}\n  body.mass: {values: [2]}", "5:3 body.mass"),
]


@pytest.mark.parametrize(("entry", "expected"), ENTRIES)
def test_entries(complaints, entry, expected):
    assert places(complaints(edited(ENTRY, entry, PLAN))).replace(" vary.", " ") == expected


LISTS = "values, linspace, logspace or geomspace"
WORDS = "values, linspace, logspace, geomspace, uniform, normal, loguniform"

# An entry in line 4, and its message after place and key.
TEXTS = [
    (PLAN, "body.mas: {values: [1]}", "is not in the base (did you mean body.mass?)"),
    (PLAN, "controller.K_tt: {values: [1]}", "is not in the base (did you mean controller.K_t?)"),
    (PLAN, "mass: {values: [1]}", "cannot vary (did you mean body.mass?)"),
    (
        PLAN,
        "samples: {values: [1]}",
        "cannot vary (expected a key of body, gravity, controller, elements, initial)",
    ),
    (
        PLAN,
        "controller.K_r: {values: [1]}",
        "is a list of 3 in the base (expected one entry, as controller.K_r[0], or scale)",
    ),
    (
        PLAN,
        "gravity: {scale: {values: [2]}}",
        "is zero in the base, where a scale has no effect (expected another base)",
    ),
    (PLAN, "body.mass: 5", f"is 5 (expected a mapping of {WORDS}, scale, zip, each, member)"),
    (PLAN, "body.mass: {scale: {}}", f"is empty (expected one of {WORDS})"),
    (PLAN, "body.mass: {values: []}", "has 0 entries (expected a list of values)"),
    (PLAN, "body.mass: {linspace: [1]}", "has 1 entry (expected [first, last, count])"),
    (
        PLAN,
        "body.mass: {linspace: [-1e308, 1e308, 3]}",
        "is [-1e+308, 1e+308] (expected numbers whose difference is finite)",
    ),
    (
        PLAN,
        "body.mass: {normal: [1, 2]}",
        f"is not a list, which a grid requires (expected {LISTS})",
    ),
    (
        PLAN,
        "controller.variant: {values: [fre]}",
        "is the text 'fre' (expected a number, or one of free, permanent, visco-elastic, embedded, "
        "sliding; did you mean free?)",
    ),
    (DRAWN, "body.mass: {uniform: [2, 2]}", "is [2, 2] (expected a < b)"),
    (DRAWN, "body.mass: {uniform: [2, 1]}", "is [2, 1] (expected a < b)"),
    (DRAWN, "body.mass: {normal: [2, 0]}", "is [2, 0] (expected a standard deviation above 0)"),
    (DRAWN, "body.mass: {normal: 5}", "is 5 (expected [mean, sd])"),
    (
        DRAWN,
        "body.mass: {normal: [1e308, 1e308]}",
        "exceeds the range of numbers (expected finite values)",
    ),
    (DRAWN, "body.mass: {loguniform: [0, 2]}", "is [0, 2] (expected 0 < a < b)"),
]


@pytest.mark.parametrize(("plan", "entry", "expected"), TEXTS)
def test_whole_messages(complaints, plan, entry, expected):
    (message,) = complaints(edited(ENTRY, entry, plan))
    assert message.split(": ", 2)[2] == expected
