"""Drift control takes the documented values, and only with settings that it works with."""

import pytest
from support.configs import PERMANENT

from rbstab.config.sections.integration import Baumgarte

CHOICES = "expected none, projection or {baumgarte: rate}"

REFUSED = [
    (
        "drift_control: projection",
        "18:18: integration.drift_control: has no effect in reduced coordinates "
        "(expected coordinates: manifold)",
    ),
    (
        "drift_control: {baumgarte: 5}",
        "18:18: integration.drift_control: has no effect in reduced coordinates "
        "(expected coordinates: manifold)",
    ),
    (
        "coordinates: quaternion\n  drift_control: projection",
        "19:18: integration.drift_control: has no effect in quaternion coordinates "
        "(expected coordinates: manifold)",
    ),
    (
        "coordinates: manifold\n  drift_control: projektion",
        f"19:18: integration.drift_control: 'projektion' is unknown "
        f"({CHOICES}; did you mean projection?)",
    ),
    (
        "coordinates: manifold\n  drift_control: 5",
        f"19:18: integration.drift_control: is neither a word nor a mapping ({CHOICES})",
    ),
    (
        "coordinates: manifold\n  drift_control: [projection]",
        f"19:18: integration.drift_control: is neither a word nor a mapping ({CHOICES})",
    ),
    (
        "coordinates: manifold\n  drift_control:",
        f"19:17: integration.drift_control: is neither a word nor a mapping ({CHOICES})",
    ),
    (
        "coordinates: manifold\n  drift_control: {baumgarte: -5}",
        "19:30: integration.drift_control.baumgarte: is -5 (expected a number greater than 0)",
    ),
    (
        "coordinates: manifold\n  drift_control: {baumgarte: true}",
        "19:30: integration.drift_control.baumgarte: is true (expected a number)",
    ),
    (
        "coordinates: manifold\n  method: LSODA\n  drift_control: projection",
        "20:18: integration.drift_control: cannot be combined with LSODA, which would lose its "
        "history at every step (expected another method)",
    ),
    ("coordinates: Z", "18:16: integration.coordinates: is the text 'Z' (expected reduced, manif"),
    # One wrong word gives one message: keys that depend on it are not checked.
    (
        "coordinates: Manifold\n  drift_control: projection",
        "18:16: integration.coordinates: is the text 'Manifold' (expected reduced, manifold or "
        "quaternion; did you mean manifold?)",
    ),
    (
        "coordinates: manifold\n  engine: spicy\n  method: LSODA\n  drift_control: projection",
        "19:11: integration.engine: is the text 'spicy' (expected scipy or heyoka; did you mean",
    ),
]


@pytest.mark.parametrize(("lines", "expected"), REFUSED)
def test_refused(complaints, lines, expected):
    (message,) = complaints(f"{PERMANENT}  {lines}\n")
    assert message.startswith(expected)


ACCEPTED = [
    ("", "none"),
    ("drift_control: none", "none"),
    ("coordinates: manifold", "none"),
    ("coordinates: manifold\n  drift_control: none", "none"),
    ("coordinates: manifold\n  drift_control: projection", "projection"),
    ("drift_control: projection\n  coordinates: manifold", "projection"),
    ("coordinates: manifold\n  drift_control: {baumgarte: 5}", Baumgarte(baumgarte=5.0)),
    # heyoka has no methods and ignores the key.
    (
        "coordinates: manifold\n  engine: heyoka\n  method: LSODA\n  drift_control: projection",
        "projection",
    ),
]


@pytest.mark.parametrize(("lines", "expected"), ACCEPTED)
def test_accepted(load, lines, expected):
    assert load(f"{PERMANENT}  {lines}\n").integration.drift_control == expected
