"""U is convex in the variables z besides Θ, with one minimiser: rules for its operations.

U is a positive definite quadratic form of z, plus functions that are convex in z by the rules: sums
with positive factors, even powers of what is affine in z, powers of what is convex and not
negative, exponentials of what is convex.
"""

from flint import arb, arb_mat

from rbstab.proof.check.bounds import minors
from rbstab.proof.check.confine import variables_of
from rbstab.proof.check.taylor import Energy

CONSTANT, AFFINE, CONVEX = 0, 1, 2


def why_not_convex(U: Energy) -> str | None:
    """Return what is not shown about U as a function of z; None if it has one minimiser."""
    shapes = _shapes(U)
    kind, _, terms = U.operations[-1]
    if kind != "sum":
        return "U is no sum"
    k = len(U.free)
    K = [[arb(0)] * k for _ in range(k)]
    for c, j in terms:
        factors = variables_of(U, j)
        if factors is not None and len(factors) == 2 and min(factors) >= 3:
            a, b = (f - 3 for f in factors)
            K[a][b] += arb(c)
            K[b][a] += arb(c)
        elif not (shapes[j] in (CONSTANT, AFFINE) or (shapes[j] == CONVEX and c > 0)):
            return f"Operation {j + 1} is not shown to be convex in z"
    definite = all(minor > 0 for minor in minors(arb_mat(K)))
    return None if definite else "The quadratic form of z is not positive definite"


def _shapes(U: Energy) -> list[int | None]:
    """Return for each operation how it depends on z; None if that is not known."""
    found, positive = list[int | None](), list[bool]()
    z = frozenset(U.free)
    for k, (kind, *rest) in enumerate(U.operations):
        shape: int | None = None
        not_negative = False
        if not U.depends[k] & z:
            shape = CONSTANT
        elif kind == "var":
            shape = AFFINE
        elif kind == "sum":
            parts = [(c, found[j]) for c, j in rest[1]]
            fits = all(s is not None and (s < CONVEX or c > 0) for c, s in parts)
            shape = max((s for _, s in parts if s is not None), default=CONSTANT) if fits else None
            not_negative = rest[0] >= 0 and all(c > 0 and positive[j] for c, j in rest[1])
        elif kind == "times":
            both = sorted((found[j] for j in rest), key=lambda s: CONVEX + 1 if s is None else s)
            shape = AFFINE if both == [CONSTANT, AFFINE] else None
        elif kind == "pow" and rest[0] > 0:
            inner, n = found[rest[1]], rest[0]
            even = n % 2 == 0
            grows = inner == CONVEX and positive[rest[1]]
            shape = CONVEX if (inner == AFFINE and even) or grows else None
            not_negative = even or positive[rest[1]]
        elif kind == "exp":
            shape, not_negative = (None if found[rest[0]] is None else CONVEX), True
        found.append(shape)
        positive.append(not_negative)
    return found
