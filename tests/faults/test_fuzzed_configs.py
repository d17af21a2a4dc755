"""Damaged configs and plans: each one is valid, or is refused with one line for each problem.

Every case is a ready config or plan of the repository with some changes of its text or of its
bytes: other values, types and indentation, repeated keys, aliases, tags, null bytes, other
encodings and line ends. A case is fixed by its number, so a failure repeats.
"""

import json
import random
import re
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config, resolved_yaml, run_id
from rbstab.sweep.plan.load import is_plan, load_plan
from rbstab.sweep.plan.plan import plan_id
from rbstab_cli.main import cli

CONFIGS = Path(__file__).parents[2] / "configs"

READY = sorted(CONFIGS.rglob("*.yaml"))

WORDS = """
.nan .inf -.inf 1e400 -1e400 1e-400 0 -0.0 -1 1e308 9999999999999999999999999999999 0x10 0o17 1_0
true no null ~ '' "1" [] {} [1] [1,2,3] [[1,2,3],[4,5,6],[7,8,9]] [.nan,1,2] {a:1} {1:2} [[[[1]]]]
free permanent visco-elastic embedded sliding Z W reduced manifold heyoka scipy grid sobol traces
*a &a &a1 *a1 !!float !!python/object:os.system !x | > - ? : , ] } [ { # % @ ` ' " --- ... << =
2020-01-01 é 😀 \\x00 \\ud800 x.yaml ../.. /dev/zero /dev/null .
"""
DISTRIBUTIONS = """
{linspace: [0,1,3]} | {values: []} | {values: [.nan]} | {normal: [0,1]} | {linspace: [1,2,1e9]}
| {scale: {values: [0]}} | {each: {values: [1]}} | {zip: {}} | {uniform: [1,0]} | {values: [1, a]}
| {logspace: [-400,400,3]} | {linspace: [1,2,99999999999]} | {zip: {body.mass: {values: [1]}}}
"""
VALUES = (*WORDS.split(), *(text.strip() for text in DISTRIBUTIONS.split("|")))

LINE = re.compile(r"(?P<source>.+?):(?P<line>\d+):(?P<column>\d+): .+")


def _new_value(rng, line):
    return f"{line.split(':', maxsplit=1)[0]}: {rng.choice(VALUES)}"


def _new_entry(rng, line):
    """Replace one number or word within a line."""
    words = list(re.finditer(r"[^\s\[\]{},:]+", line))
    if not words:
        return line
    word = rng.choice(words)
    return line[: word.start()] + rng.choice(VALUES) + line[word.end() :]


def _indent(rng, line):
    return rng.choice(["", " ", "  ", "    ", "\t", "- ", "? ", "# "]) + line.lstrip()


def _insert(rng, line):
    place = rng.randrange(len(line) + 1)
    piece = rng.choice([*VALUES, " ", "\t", "\0", "\x1b", "\ufeff", "\u2028", "\x85", "x" * 3000])
    return line[:place] + piece + line[place:]


def _cut(rng, line):
    start = rng.randrange(len(line) + 1)
    return line[:start] + line[start + rng.randrange(1, 9) :]


def _nest(rng, line):
    depth = rng.choice([2, 15, 16, 17, 500])
    return f"{line.split(':', maxsplit=1)[0]}: {'[' * depth}1{']' * depth}"


EDITS = (_new_value, _new_entry, _new_entry, _indent, _insert, _cut, _nest)
"""What may be done with one line; with two lines, there are four changes more."""


def _change(rng, lines):
    """Change some lines at random."""
    i, k = (rng.randrange(len(lines)) for _ in range(2))
    kind = rng.randrange(len(EDITS) + 4) - len(EDITS)
    if kind < 0:
        lines[k] = EDITS[kind](rng, lines[k])
    elif kind == 0:
        lines.insert(i, lines[k])
    elif kind == 1:
        del lines[k]
    elif kind == 2:
        lines[i], lines[k] = lines[k], lines[i]
    else:
        lines[i] = lines[i].replace(": ", ": &one ", 1)
        lines[k] = f"{lines[k].split(':')[0]}: *one"


def _encoded(rng, lines):
    """Join lines and encode them, mostly as UTF-8 with line feeds."""
    text = rng.choice(["\n"] * 6 + ["\r\n", "\r"]).join(lines) + "\n"
    encoding = rng.choice(["utf-8"] * 7 + ["utf-8-sig", "utf-16", "utf-32", "latin-1", "cp500"])
    raw = text.encode(encoding, errors="replace")
    if rng.random() < 0.05:
        place = rng.randrange(len(raw) + 1)
        raw = raw[:place] + bytes([rng.randrange(256)]) + raw[place:]
    return raw[: rng.randrange(len(raw))] if rng.random() < 0.03 else raw


def _case(number):
    """Return the ready file of a case, and its damaged bytes."""
    rng = random.Random(number)  # noqa: S311 (no secret)
    path = READY[number % len(READY)]
    lines = path.read_text(encoding="utf-8").splitlines()
    for _ in range(rng.choice([1, 1, 1, 2, 3, 6])):
        if lines:
            _change(rng, lines)
    return path, _encoded(rng, lines)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A copy of the ready configs, so that plans find their bases."""
    copy = tmp_path_factory.mktemp("fuzz") / "configs"
    shutil.copytree(CONFIGS, copy)
    return copy


def _load(path):
    """Load a config or a plan, and check what it gives.

    Raises:
        ConfigError: It is not valid.
    """
    if is_plan(path):
        plan = load_plan(path)
        assert plan_id(plan) == plan_id(load_plan(path))
        assert plan.members >= 1
        assert plan.config_of(plan.members - 1)
    else:
        config = load_config(path)
        # A number that is not finite raises an error.
        json.dumps(config.model_dump(), allow_nan=False)
        copy = path.with_name("copy.yaml")
        copy.write_text(resolved_yaml(config), encoding="utf-8")
        assert run_id(load_config(copy)) == run_id(config)


def _is_valid(path):
    """Load a config or a plan; if it is not valid, check the messages of its error."""
    try:
        _load(path)
    except ConfigError as error:
        problems = error.problems
    else:
        return True
    assert 0 < len(problems) <= 100
    for message in map(str, problems):
        assert message.isprintable()
        assert len(message) < 1500
        match = LINE.fullmatch(message)
        assert match is not None, message
        assert Path(match["source"]).suffix == ".yaml"
    return False


def _written(folder, number):
    ready, raw = _case(number)
    path = folder / ready.parent.relative_to(CONFIGS) / "case.yaml"
    path.write_bytes(raw)
    return path


def _outcomes(folder, numbers):
    for number in numbers:
        path = _written(folder, number)
        try:
            yield _is_valid(path)
        except Exception as error:  # every other exception is the failure of this test
            pytest.fail(f"case {number}: {type(error).__name__}: {error}")


def test_every_case_is_valid_or_refused_by_its_problems(folder):
    outcomes = list(_outcomes(folder, range(300)))
    # Both occur, so the cases test both.
    assert 15 < sum(outcomes) < 285


@pytest.mark.slow
def test_many_cases(folder):
    outcomes = list(_outcomes(folder, range(1_000, 6_000)))
    assert 250 < sum(outcomes) < 4_750


def test_the_command_line_prints_the_same_lines(folder):
    for number in range(10_000, 10_040):
        path = _written(folder, number)
        done = CliRunner().invoke(cli, ["check", str(path)], prog_name="rbstab")
        assert done.exit_code in (0, 2), (number, done.exception)
        assert done.exception is None or isinstance(done.exception, SystemExit)
        assert (done.stdout == "") == (done.exit_code == 2), number
        if done.exit_code == 2:
            assert all(LINE.fullmatch(line) for line in done.stderr.splitlines()), number
