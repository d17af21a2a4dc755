"""Any input gives a config or a ConfigError, and never another exception."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.configs import BY_VARIANT, PERMANENT, plain

from rbstab.config.errors import ConfigError
from rbstab.config.load import load_config, resolved_yaml, run_id

# Derandomized, so that a failure repeats. No database, so that no files are left behind.
FUZZ = settings(
    max_examples=150,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=list(HealthCheck),
)
LONG = settings(FUZZ, max_examples=300)

TEXTS = [*BY_VARIANT.values(), PERMANENT + "  coordinates: manifold\n  drift_control: none\n"]


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz") / "config.yaml"


def check(config, changes=()):
    """Assert that each problem has a line, or that the config can be stored."""
    try:
        loaded = load_config(config, changes)
    except ConfigError as error:
        lines, count = str(error).split("\n"), len(error.problems)
    else:
        lines, count = [run_id(loaded)], 1
        assert resolved_yaml(loaded)
    assert len(lines) == count > 0
    assert all(line and line.isprintable() for line in lines)


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


@LONG
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
    check(data)


SIGNS = ". . . [0] [1] [9] = = -1 free [ ] x {a: 1 , } *a"
PARTS = st.sampled_from([*NAMES.split(), *SIGNS.split()])


@FUZZ
@given(parts=st.lists(PARTS | st.text(max_size=3), max_size=6), more=st.text(max_size=5))
def test_any_change(path, parts, more):
    path.write_text(BY_VARIANT["visco-elastic"], encoding="utf-8")
    check(path, ["".join(parts), "".join(parts) + "=" + more])
