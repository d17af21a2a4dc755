"""Any input gives a config or a ConfigError, and never another exception."""

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from support.configs import BY_VARIANT, PERMANENT, plain

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config, resolved_yaml, run_id
from rbstab.config.schema import Experiment

# Derandomized, so that a failure repeats. No database, so that no files are left behind.
FUZZ = settings(
    max_examples=150,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=list(HealthCheck),
)

TEXTS = [*BY_VARIANT.values(), PERMANENT + "  coordinates: manifold\n  drift_control: none\n"]

VALUES = """
-1 0 1e999 .nan -.inf true null ~ yes '' "1" [] {} [1] [1,2,3] [[1,2,3],[4,5,6],[7,8,9]] {a:1}
*a &a !!float ! | > - ? : , ] } [ { # % @ ` ' " 1e-400 2020-01-01 free embedded rigid reduced Z W
manifold projection {baumgarte:1} heyoka LSODA 9999999999999999999 --- ... << = é 😀
"""
NASTY = [*VALUES.split(), "", " ", "\t", "\x00", "\x1b", "\ufeff", "\u2028"]


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz") / "config.yaml"


def outcome(config, changes=()):
    """Return the config or its ConfigError; any other exception fails the test."""
    try:
        return load_config(config, changes)
    except ConfigError as error:
        return error


def check(found):
    """Assert that an error has one line for each problem, and that a config can be stored."""
    if isinstance(found, ConfigError):
        lines = str(found).split("\n")
        assert len(lines) == len(found.problems) > 0
        assert all(line and line.isprintable() for line in lines)
    else:
        assert isinstance(found, Experiment)
        assert len(run_id(found)) == 32
        assert resolved_yaml(found)


@FUZZ
@given(text=st.text(max_size=300))
def test_any_text(path, text):
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    check(outcome(path))


@FUZZ
@given(raw=st.binary(max_size=200))
def test_any_bytes(path, raw):
    path.write_bytes(raw)
    check(outcome(path))


@settings(FUZZ, max_examples=300)
@given(data=st.data())
def test_any_damage_to_a_good_config(path, data):
    lines = data.draw(st.sampled_from(TEXTS)).splitlines()
    for _ in range(data.draw(st.integers(1, 4))):
        index = data.draw(st.integers(0, len(lines) - 1))
        line = lines[index]
        match data.draw(st.integers(0, 5)):
            case 0:
                lines[index] = line.split(":")[0] + ": " + data.draw(st.sampled_from(NASTY))
            case 1:
                del lines[index]
            case 2:
                lines.insert(data.draw(st.integers(0, len(lines))), line)
            case 3:
                at = data.draw(st.integers(0, len(line)))
                lines[index] = line[:at] + data.draw(st.sampled_from(NASTY)) + line[at:]
            case 4:
                lines[index] = data.draw(st.sampled_from(["  ", " ", "- ", ""])) + line.lstrip()
            case 5:
                at = data.draw(st.integers(0, len(line)))
                lines[index] = line[:at] + line[at + 1 :]
        if not lines:
            break
    path.write_bytes("\n".join(lines).encode())
    check(outcome(path))


SCALARS = (
    st.none()
    | st.booleans()
    | st.integers(-(10**30), 10**30)
    | st.floats()
    | st.text(max_size=8)
    | st.sampled_from(["free", "permanent", "embedded", "Z", "reduced", "projection"])
)
NAMES = """
title body mass inertia controller variant K_t K_d initial orientation integration samples
drift_control baumgarte reference source final
"""
KEYS = st.text(max_size=5) | st.sampled_from(NAMES.split())
TREES = st.recursive(
    SCALARS,
    lambda below: st.lists(below, max_size=4) | st.dictionaries(KEYS, below, max_size=4),
    max_leaves=12,
)


@FUZZ
@example(data={"[key]": None})
@example(data={"schema_version": 2, "elements": {"strut": {"kind": "attitude", "[key]": 1}}})
@given(data=st.dictionaries(KEYS, TREES, max_size=6))
def test_any_plain_data(data):
    check(outcome(data))


@settings(FUZZ, max_examples=300)
@given(where=st.lists(st.integers(0, 5), min_size=1, max_size=3), tree=TREES, variant=st.data())
def test_any_value_in_a_good_config(where, tree, variant):
    data = plain(variant.draw(st.sampled_from(TEXTS)))
    here = data
    for step in where[:-1]:
        keys = [key for key in here if isinstance(here[key], dict)]
        if not keys:
            break
        here = here[keys[step % len(keys)]]
    here[list(here)[where[-1] % len(here)]] = tree
    check(outcome(data))


SIGNS = ". . . [0] [1] [9] = = -1 free [ ] x {a: 1 , } *a"
PARTS = st.sampled_from([*NAMES.split(), *SIGNS.split()])


@FUZZ
@given(parts=st.lists(PARTS | st.text(max_size=3), max_size=6), more=st.text(max_size=5))
def test_any_change(path, parts, more):
    path.write_text(BY_VARIANT["visco-elastic"], encoding="utf-8")
    check(outcome(path, ["".join(parts), "".join(parts) + "=" + more]))
