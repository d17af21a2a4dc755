"""The switches of an element of a user: its energy is continuous there, and so may its force be.

With σ_i = 1 where the event function g_i is positive, and else 0, E = E₀ + Σ σ_i T_i. Each T_i must
be zero where g_i is; so E is continuous. If ∇T_i is zero there too, the force is. Else it jumps: on
the surface ∇T_i = k_i ∇g_i, and k_i = ∇T_i·∇g_i/|∇g_i|² must have one sign. If it is never below
zero, the force pulls back to the surface, and E has a valley there; if never above, E has a ridge.
"""

from collections.abc import Iterator, Sequence
from enum import Enum

from rbstab.proof.exact.expr import LET, Atom, Expr, Monomial, as_factor, expr, monomial, only
from rbstab.proof.exact.rewriting import derivative, substituted
from rbstab.proof.passive.expanded import is_zero
from rbstab.proof.passive.signs import divided, never_negative
from rbstab.proof.passive.statements import Statements

MOST_MODES = 6
"""The most switches of one element: a guard on both sides of each angle has so many."""

MOST_ROUNDS = 40

NOT_OF_ANGLES = (
    "it switches, and its energy or an event function depends on more than Θ (and, for the energy, "
    "its own states, or its own states and X)"
)

NOT_CONTINUOUS = (
    "it is not shown that `stored` is continuous at its switches: each of its terms with a mode "
    "must have just one mode, and be zero where its event function is, as with this or its square "
    "as another factor"
)

SIGN_UNKNOWN = (
    "its force jumps at a switch, and it is not seen from `stored` whether it pulls back to it or "
    "pushes away from it everywhere (whether the factor of the mode and its event function is "
    "never negative, or never positive)"
)

JUMPS_BY_MORE = (
    "its force jumps at a switch, and the factor of the mode and its event function in `stored` "
    "depends on more than Θ"
)


class Switched(Enum):
    """What happens at a switch."""

    SMOOTH = "the force is continuous"
    VALLEY = "the force jumps, and pulls back"
    RIDGE = "the force jumps, and pushes away"


def why_not_continuous(statements: Statements) -> str | None:
    """Return what is not shown of the switches of an element; None if all is."""
    of, Theta = statements.of_motion, set(range(3))
    others = of.stored.variables.difference(Theta, *(a.variables for a in statements.modes))
    if any(not g.variables <= Theta for g in of.guards) or (others and not statements.own):
        return NOT_OF_ANGLES
    kinds = _kinds(statements)
    if kinds is None:
        return NOT_CONTINUOUS
    parts = _parts(of.guards, of.stored, statements.modes) or []
    for kind, (_, T) in zip(kinds, parts, strict=True):
        if kind is not Switched.SMOOTH and not T.variables <= Theta:
            return JUMPS_BY_MORE
        if kind is None:
            return SIGN_UNKNOWN
    return None


def force_is_continuous(statements: Statements) -> bool:
    """Return whether the force is continuous at all switches, of which all else is shown."""
    kinds = _kinds(statements)
    return kinds is not None and set(kinds) <= {Switched.SMOOTH}


def _kinds(statements: Statements) -> list[Switched | None] | None:
    """Return what happens at each surface, with None where it is not seen.

    It is looked for in functions of the entries of a motion, and in those of q.

    Returns:
        None if it is not shown that the energy is continuous.
    """
    best: list[Switched | None] | None = None
    surfaces = _parts(statements.of_motion.guards, statements.of_motion.stored, statements.modes)
    for of in (statements.of_entries, statements.of_motion):
        parts = _parts(of.guards, of.stored, statements.modes)
        if parts is None or surfaces is None or len(parts) != len(surfaces):
            continue
        if all(_vanishes(T, g) for g, T in parts):
            found = [_kind(g, T) for g, T in parts]
            if best is None or best.count(None) > found.count(None):
                best = found
    return best


def _parts(
    guards: Sequence[Expr], stored: Expr, modes: Sequence[Atom]
) -> list[tuple[Expr, Expr]] | None:
    """Return each g_i with its T_i, one for each surface; None if E is not of this form."""
    found = dict.fromkeys(modes, expr(0))
    for m, c in _with_modes_apart(stored, frozenset(modes)).terms.items():
        switching = [(a, p) for a, p in m if a in found]
        rest = Expr({tuple(one for one in m if one[0] not in found): c})
        if any(a in found for a in rest.all_atoms) or len(switching) > 1:
            return None
        for a, p in switching:
            if p < 1:
                return None
            found[a] = found[a] + rest
    parts: dict[Expr, Expr] = {}
    for g, T in zip(guards, found.values(), strict=True):
        if -g in parts:  # step(-g) = 1 - step(g)
            parts[-g] = parts[-g] - T
        else:
            parts[g] = parts.get(g, expr(0)) + T
    return list(parts.items())


def _with_modes_apart(e: Expr, modes: frozenset[Atom]) -> Expr:
    """Multiply out the sums in which modes stand, until modes are factors of terms."""
    for _ in range(MOST_ROUNDS):
        total, changed = expr(0), False
        for m, c in e.terms.items():
            inside = [
                a for a, p in m if a.kind == LET and p > 0 and not modes.isdisjoint(a.inner.atoms)
            ]
            if not inside:
                total = total + Expr({m: c})
                continue
            changed = True
            a = inside[0]
            rest = Expr({monomial((b, p - (b is a)) for b, p in m): c})
            for one, number in a.inner.terms.items():
                total = total + rest * Expr({one: number})
        e = total
        if not changed:
            break
    return e


def _kind(g: Expr, T: Expr) -> Switched | None:
    """Return what happens at one surface; None if it is not seen."""
    numbers = T.variables | g.variables
    slopes = {k: derivative(T, {k: expr(1)}) for k in sorted(numbers)}
    if all(_vanishes(slope, g) for slope in slopes.values()):
        return Switched.SMOOTH
    share = sum((derivative(g, {k: expr(1)}) * slope for k, slope in slopes.items()), expr(0))
    on_surface = [share, *_on_surface(share, g)]
    if any(never_negative(one) for one in on_surface):
        return Switched.VALLEY
    return Switched.RIDGE if any(never_negative(-one) for one in on_surface) else None


def _vanishes(e: Expr, g: Expr) -> bool:
    """Return whether an expression is shown to be zero wherever another one is."""
    return is_zero(e) or any(map(is_zero, _on_surface(e, g)))


def _on_surface(e: Expr, g: Expr) -> Iterator[Expr]:
    """Yield forms of an expression where g = 0: one term of g stands for all others."""
    for m, c in sorted(g.terms.items(), key=lambda one: len(one[0])):
        if not m:
            continue
        rest = Expr({m: c}) - g
        rest = rest.scaled(1 / c)
        if len(m) == 1 and m[0][1] == 1:
            a = m[0][0]
            if a not in rest.all_atoms:
                yield substituted(e, {a: rest})
        else:
            yield _replaced(e, m, rest)


def _replaced(e: Expr, m: Monomial, rest: Expr) -> Expr:
    """Put an expression in place of a product, also inside sums that stand as factors."""
    for _ in range(MOST_ROUNDS):
        total, changed = expr(0), False
        for one, c in e.terms.items():
            left = divided(one, m)
            if left is not None:
                total, changed = total + Expr({left: c}) * rest, True
                continue
            term = expr(c)
            for a, p in one:
                base = only(a)
                if a.kind == LET:
                    base = as_factor(_replaced(a.inner, m, rest))
                term = term * base**p
            total = total + term
        e = total
        if not changed:
            break
    return e
