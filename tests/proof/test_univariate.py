"""Taylor coefficients of functions of one number, against series of 300 bits.

Those over intervals are operations of `test_intervals`; `test_bounds` has them in energies.
"""

import numpy as np
import pytest
from flint import arb_series, ctx
from support.balls import BITS, ball, contains

from rbstab.proof.enclosures.intervals import Intervals
from rbstab.proof.enclosures.univariate import coefficients
from rbstab.proof.exact.atoms import COS, SIN

KINDS: list[tuple[str, int | None]] = [
    (name, None) for name in (SIN, COS, "exp", "sqrt", "log", "atan")
]
KINDS += [("power", n) for n in (-3, -1, 2, 3, 5)]


def exact(kind, extra, x):
    """Return g, g', g''/2 and g'''/6 at a double."""
    with ctx.workprec(BITS):
        at = arb_series([ball(x), 1], 4)
        series = at**extra if kind == "power" else getattr(at, kind)()
        return [series[k] for k in range(4)]


def over(kind, extra, low, high):
    """Return the coefficients over an interval."""
    rows = coefficients(kind, extra, np.array([[low], [high]]), 3)
    return [Intervals.of(row) for row in rows]


@pytest.mark.parametrize(("kind", "extra"), KINDS)
def test_at_a_point_they_are_those_numbers(kind, extra):
    """To some ulps, also of (3x² - 1) d³/3 of the arc tangent, which is zero at 1/√3."""
    wide = over(kind, extra, 0.3, 2.5)
    for x in (0.3, 1.0, 3**-0.5, 2.5):
        at = over(kind, extra, x, x)
        for narrow, of_all, value in zip(at, wide, exact(kind, extra, x), strict=True):
            assert contains(narrow, 0, value)
            assert contains(of_all, 0, value)
            assert narrow.hi[0] - narrow.lo[0] < 1e-12 * max(1.0, abs(float(value)))


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_what_ends_is_known_and_what_has_no_bound_is_not():
    """x² has no third coefficient, exactly; a root has no slope at zero, a logarithm no value."""
    square = over("power", 2, -np.inf, 2.0)
    assert (square[3].lo[0], square[3].hi[0]) == (0.0, 0.0)
    root = over("sqrt", None, 0.0, 4.0)
    assert root[0].lo[0] == 0.0
    without = [*root[1:], *over("log", None, 0.0, 4.0)]
    assert all(
        coefficient.lo[0] == -np.inf and coefficient.hi[0] == np.inf for coefficient in without
    )
