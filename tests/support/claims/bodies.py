"""Random bodies of all kinds, always the same ones: the configs of the table of claims.

Each recipe says what holds the body and which elements it has; sizes, gains, load and start are
drawn. Stiffnesses are measured against the weight and the size, so that some bodies have one rest
state, and some have several.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

Data = dict[str, Any]

SEED = 42

HELD, TIED, EMBEDDED, FREE = "permanent", "visco-elastic", "embedded", "free"
SLIDING, NONE = "sliding", "none"

RECIPES: list[tuple[str, float, tuple[str, ...]]] = [
    # What holds the body, K_r against the moments of the load and of K_t (0: no K_r), elements.
    (HELD, 0.15, ()),
    (HELD, 0.6, ()),
    (HELD, 2.0, ("weight",)),
    (HELD, 0.0, ("attitude",)),
    (HELD, 0.05, ("barrier",)),
    (HELD, 1.0, ("spring",)),
    (HELD, 0.3, ("spring", "spring")),
    (HELD, 0.3, ("ligament",)),
    (HELD, 1.0, ("ligament", "ligament", "barrier")),
    (HELD, 0.5, ("stiff",)),
    (HELD, 0.3, ("repelling",)),
    (HELD, 0.2, ("stop",)),
    (HELD, 1.5, ("stop",)),
    (HELD, 1.0, ("closed",)),
    (HELD, 0.5, ("tie", "creeping tie")),
    (HELD, 1.0, ("stiffening spring",)),
    (HELD, 0.3, ("cubic tie", "barrier")),
    (HELD, 0.5, ("magnet",)),
    (HELD, 0.3, ("magnet", "barrier")),
    (HELD, 0.5, ("latch",)),
    (HELD, 1.0, ("counterweight",)),
    (HELD, 0.6, ("counterweight", "barrier")),
    (HELD, 0.6, ("rubber cord",)),
    (HELD, 1.0, ("creeping cord", "barrier")),
    (HELD, 0.6, ("rope",)),
    (HELD, 0.8, ("softening tie",)),
    (HELD, 0.8, ("spring without length", "attitude")),
    (HELD, 0.0, ("attitude", "tie", "barrier")),
    (HELD, 0.0, ("attitude", "ligament")),
    (TIED, 0.15, ()),
    (TIED, 0.8, ("weight",)),
    (TIED, 2.0, ("attitude",)),
    (TIED, 0.0, ("attitude", "tie")),
    (TIED, 1.0, ("barrier",)),
    (TIED, 0.3, ("stiff",)),
    (TIED, 0.5, ("repelling", "tie")),
    (TIED, 1.0, ("stop",)),
    (TIED, 2.0, ("spring",)),
    (TIED, 3.0, ("spring", "barrier")),
    (TIED, 1.0, ("spring without length",)),
    (TIED, 2.0, ("ligament",)),
    (TIED, 1.5, ("ligament", "barrier")),
    (TIED, 1.0, ("cubic tie",)),
    (TIED, 1.0, ("magnet",)),
    (TIED, 1.0, ("softening tie",)),
    (TIED, 1.0, ("user's creeping tie",)),
    (TIED, 1.0, ("latch",)),
    (EMBEDDED, 0.15, ()),
    (EMBEDDED, 1.0, ("weight", "barrier")),
    (EMBEDDED, 0.8, ("creeping tie",)),
    (EMBEDDED, 2.0, ("spring",)),
    (EMBEDDED, 1.0, ("stop",)),
    (EMBEDDED, 1.0, ("stiff",)),
    (FREE, 0.3, ()),
    (FREE, 0.3, ("tie", "attitude")),
    (FREE, 1.0, ("spring",)),
    (FREE, 0.0, ("attitude",)),
    (FREE, 0.5, ("closed",)),
    (SLIDING, 1.0, ()),
    (SLIDING, 0.5, ("barrier",)),
    (NONE, 0.0, ("foot", "attitude")),
    (NONE, 0.0, ("mounts",)),
    (NONE, 0.0, ("foot", "attitude", "spring", "barrier")),
    (NONE, 0.0, ("foot", "attitude", "sliding tie")),
    (NONE, 0.0, ("foot", "attitude", "ligament")),
    (NONE, 0.0, ("user's creeping tie", "attitude", "barrier")),
    (TIED, 1.0, ("input",)),
]


class Draw:
    """The random numbers of one body, in sizes that fit it."""

    def __init__(self, number: int) -> None:
        self._rng = np.random.default_rng([SEED, number])
        self.mass = self.between(1.0, 40.0)
        sides = [self.between(0.1, 0.3) * self.mass**0.33 for _ in range(3)]
        self.half = [0.5 * side for side in sides]
        self.size = float(np.linalg.norm(self.half))
        squares = [side * side for side in sides]
        self.inertia = [self.mass * (sum(squares) - one) / 12 for one in squares]
        down = [(0.0, 0.0, -9.81), (0.0, 0.0, 0.0), tuple(self.vector(5.0) - [0, 0, 7.0])]
        self.gravity = [float(g) for g in down[self._rng.choice(3, p=[0.6, 0.15, 0.25])]]
        self.k = self.mass * self.between(6.0, 14.0) ** 2
        """N/m: K_t, as ω²m."""
        load = self.mass * float(np.linalg.norm(self.gravity)) * self.size
        self.moment = load + self.k * self.size**2
        """N m: what the load and K_t may do about C."""

    def between(self, low: float, high: float) -> float:
        """Return a number of a range, evenly by its logarithm."""
        return float(np.exp(self._rng.uniform(np.log(low), np.log(high))))

    def vector(self, size: float) -> Any:
        return self._rng.uniform(-size, size, 3)

    def three(self, middle: float) -> list[float]:
        """Return three gains near one."""
        return [middle * self.between(0.7, 1.4) for _ in range(3)]

    def point(self) -> list[float]:
        """Return a point in the body."""
        return [half * float(self._rng.uniform(-1, 1)) for half in self.half]

    def face(self) -> list[float]:
        """Return a point near the middle of a face of the body."""
        axis = int(self._rng.integers(3))
        found = [0.25 * entry for entry in self.point()]
        found[axis] = self.half[axis] * float(self._rng.choice([-1, 1]))
        return found

    def near(self, point: list[float], distance: float) -> list[float]:
        """Return a point at a distance from one of the body in its rest pose."""
        step = self.vector(1.0)
        return list(point + distance * step / np.linalg.norm(step))


def _spring(draw: Draw) -> Data:
    point, distance = draw.point(), draw.size * draw.between(1.5, 3.0)
    return {
        "kind": "spring",
        "point": point,
        "anchor": draw.near(point, distance),
        "stiffness": draw.k * draw.between(0.1, 0.5),
        "rest_length": distance * draw.between(0.7, 1.1),
        "damping": draw.k * 0.02,
    }


def _spring_without_length(draw: Draw) -> Data:
    point = draw.point()
    anchor = draw.near(point, draw.size)
    stiffness = draw.k * draw.between(0.1, 0.5)
    return {
        "kind": "spring",
        "point": point,
        "anchor": anchor,
        "stiffness": stiffness,
        "rest_length": 0,
    }


def _ligament(draw: Draw) -> Data:
    point, distance = draw.point(), draw.size * draw.between(1.2, 2.5)
    return {
        "kind": "ligament",
        "point": point,
        "anchor": draw.near(point, distance),
        "stiffness": draw.k * distance * draw.between(0.1, 0.6),
        "slack_length": distance * draw.between(0.85, 1.2),
        "toe_strain": draw.between(0.03, 0.15),
        "damping": draw.k * 0.005,
    }


def _tie(draw: Draw, point: list[float] | None = None) -> Data:
    at = draw.point() if point is None else point
    stiffness = draw.three(draw.k)
    damping = [0.05 * k for k in stiffness]
    return {"kind": "visco-elastic", "point": at, "anchor": at, "K_c": stiffness, "L_c": damping}


def _foot(draw: Draw) -> Data:
    return _tie(draw, draw.face())


def _creeping_tie(draw: Draw, point: list[float] | None = None) -> Data:
    found = _tie(draw, point)
    slow = draw.three(0.7 * draw.k)
    return {**found, "kind": "embedded", "K_d": slow, "L_d": [0.3 * k for k in slow]}


def _attitude(draw: Draw) -> Data:
    K = draw.three(draw.moment * draw.between(0.05, 1.0))
    return {"kind": "attitude", "K": K, "L": [0.05 * k for k in K]}


def _sliding_tie(draw: Draw) -> Data:
    point = draw.point()
    force = draw.three(draw.mass * 10)
    return {
        "kind": "sliding",
        "point": point,
        "anchor": point,
        "K_s": force,
        "surface": {"slope": 8},
    }


def _input(draw: Draw) -> Data:
    return {
        "kind": "input",
        "quantity": "force",
        "point": draw.point(),
        "direction": [1, 0, 0],
        "amplitude": draw.mass,
        "signal": {"kind": "sine", "frequency": 2},
    }


def _guard(method: str) -> Callable[[Draw], Data]:
    def of(draw: Draw) -> Data:
        found: Data = {"kind": "guard", "method": method}
        if method in ("barrier", "closed"):
            found |= {"method": "barrier", "stiffness": draw.moment * draw.between(0.005, 0.1)}
        if method == "closed":
            found["outer_stiffness"] = found["stiffness"]
        if method == "stiff":
            found |= {"stiffness": draw.moment * draw.between(1, 5)}
        if method == "repelling":
            found |= {"couple": draw.moment * draw.between(0.1, 1)}
        if method in ("stiff", "repelling"):
            found["soft_angle"] = draw.between(0.4, 1.2)
        if method == "stop":
            found |= {"angle": draw.between(0.5, 1.3), "restitution": draw.between(0.2, 0.8)}
        return found

    return of


OWN = "tests/claims/own_elements.py"


def _user(file: str, name: str, parameters: Callable[[Draw], Data]) -> Callable[[Draw], Data]:
    def of(draw: Draw) -> Data:
        given = parameters(draw)
        return {"kind": "python", "file": file, "class": name, "parameters": given}

    return of


def _line(draw: Draw, stretch: tuple[float, float], **gains: float) -> Data:
    """Return a point, an anchor and a length for a line, with gains."""
    point, distance = draw.point(), draw.size * draw.between(2.0, 3.0)
    length = distance * draw.between(*stretch)
    # Around C, a held body turns its points by less than twice its size.
    return {"point": point, "anchor": draw.near(point, 2 * distance), "length": 2 * length, **gains}


def _weight(draw: Draw) -> Data:
    force = draw.mass * draw.vector(5.0)
    return {"point": draw.point(), "force": list(force)}


def _stiffening(draw: Draw) -> Data:
    gains = {"k": 0.2 * draw.k, "h": draw.k * draw.between(0.2, 2) / draw.size**2}
    return _line(draw, (0.8, 1.1), **gains)


def _cubic_tie(draw: Draw) -> Data:
    at = draw.point()
    stiff = draw.three(draw.k / draw.size**2)
    return {"point": at, "anchor": draw.near(at, 0.3 * draw.size), "k": draw.three(0.3 * draw.k),
            "h": stiff}  # fmt: skip


def _magnet(draw: Draw) -> Data:
    at = draw.face()
    depth = draw.moment * draw.between(0.1, 0.6)
    return {"point": at, "anchor": draw.near(at, draw.size), "depth": depth, "width": draw.size / 2}


def _softening(draw: Draw) -> Data:
    at = draw.point()
    anchor = draw.near(at, draw.size)
    return {"point": at, "anchor": anchor, "k": 0.3 * draw.k, "width": 0.5 * draw.size}


def _users_tie(draw: Draw) -> Data:
    found = _creeping_tie(draw)
    return {key: found[key] for key in ("point", "anchor", "K_c", "L_c", "K_d", "L_d")}


ELEMENTS: dict[str, Callable[[Draw], Data]] = {
    "spring": _spring,
    "spring without length": _spring_without_length,
    "ligament": _ligament,
    "tie": _tie,
    "foot": _foot,
    "creeping tie": _creeping_tie,
    "attitude": _attitude,
    "sliding tie": _sliding_tie,
    "input": _input,
    **{name: _guard(name) for name in ("barrier", "closed", "stiff", "repelling", "stop")},
    "weight": _user(OWN, "Weight", _weight),
    "stiffening spring": _user(OWN, "StiffeningSpring", _stiffening),
    "cubic tie": _user(OWN, "CubicTie", _cubic_tie),
    "softening tie": _user(OWN, "SofteningTie", _softening),
    "rope": _user(
        OWN,
        "Rope",
        lambda draw: _line(draw, (0.85, 1.05), stiffness=draw.k * draw.between(0.1, 0.5)),
    ),
    "creeping cord": _user(
        OWN,
        "CreepingCord",
        lambda draw: _line(draw, (0.8, 1.0), k=0.3 * draw.k, slow=0.2 * draw.k, damping=draw.k),
    ),
    "magnet": _user("configs/examples/magnet.py", "Magnet", _magnet),
    "latch": _user(
        "configs/examples/latch.py",
        "Latch",
        lambda draw: {"k": 2 * draw.moment * draw.between(0.3, 1), "reach": draw.between(0.2, 0.6)},
    ),
    "counterweight": _user(
        "configs/examples/counterweight.py",
        "Counterweight",
        lambda draw: _line(draw, (0.95, 1.02), weight=draw.mass * draw.between(2, 10)),
    ),
    "rubber cord": _user(
        "configs/examples/rubber_cord.py",
        "RubberCord",
        lambda draw: _line(
            draw,
            (0.95, 1.0),
            stiffness=0.2 * draw.k,
            scale=0.5 * draw.size,
            slow_stiffness=0.2 * draw.k,
            damping=draw.k / 10,
        ),
    ),
    "user's creeping tie": _user("configs/examples/creeping_tie.py", "CreepingTie", _users_tie),
}


def bodies() -> dict[str, Data]:
    """Return the config of each recipe, by a name that tells what is in it."""
    found = {}
    for number, (holding, turning, kinds) in enumerate(RECIPES):
        words = [holding, *kinds] if turning else [holding, "no K_r", *kinds]
        found[f"{number:02d} {', '.join(words)}"] = _body(Draw(number), holding, turning, kinds)
    return found


def _body(draw: Draw, holding: str, turning: float, kinds: tuple[str, ...]) -> Data:
    contact = draw.face()
    data: Data = {
        "schema_version": 2,
        "body": {"mass": draw.mass, "inertia": draw.inertia, "contact_point": contact},
        "gravity": draw.gravity,
    }
    if holding != NONE:
        data["controller"] = _controller(draw, holding, turning)
    elements: dict[str, Data] = {}
    for kind in kinds:
        made = (
            [_creeping_tie(draw, draw.face()) for _ in range(3)]
            if kind == "mounts"
            else [ELEMENTS[kind](draw)]
        )
        for one in made:
            elements[f"e{len(elements)}"] = one
    data["elements"] = elements
    data["initial"] = {
        "orientation": list(draw.vector(0.4)),
        "angular_velocity": list(draw.vector(draw.between(0.5, 12.0))),
    }
    if holding != HELD:
        data["initial"]["attached"] = True
    data["integration"] = {"duration": 2, "samples": 11}
    return _short(data)


def _controller(draw: Draw, holding: str, turning: float) -> Data:
    k, moment = draw.k, draw.moment
    found: Data = {"variant": holding}
    # A held body needs no K_t, and a tie carries one that is not held.
    found["K_t"] = draw.three(k * draw.between(0.03, 0.5))
    found["L_t"] = [0.05 * one for one in found["K_t"]]
    if turning:
        K_r = np.diag(draw.three(0.25 * moment * turning))
        if draw.between(1, 10) > 7:
            K_r[0, 1] = K_r[1, 0] = 0.3 * K_r[0, 0]
        found["K_r"] = K_r.tolist() if K_r[0, 1] else np.diag(K_r).tolist()
    found["L_r"] = draw.three(0.05 * moment)
    if holding in (TIED, EMBEDDED):
        found["K_c"] = draw.three(k * draw.between(1, 4))
        found["L_c"] = [0.05 * one for one in found["K_c"]]
    if holding == EMBEDDED:
        found["K_d"] = draw.three(k * draw.between(1, 4))
        found["L_d"] = [0.1 * one for one in found["K_d"]]
    if holding == SLIDING:
        found |= {"K_s": draw.three(draw.mass * 30), "surface": {"slope": 10}}
    return found


def _short(value: Any) -> Any:
    """Return data with numbers of three digits."""
    if isinstance(value, dict):
        return {key: _short(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_short(entry) for entry in value]
    return float(f"{value:.3g}") if isinstance(value, float) else value
