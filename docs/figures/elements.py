"""Drawings of docs/elements.md: one of each kind of element, as SVG for light and dark pages.

`make figures` runs this script. The energies are those of the elements themselves.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from rbstab.elements.attitude_spring import AttitudeSpring
from rbstab.elements.element import NO_STATE, Element
from rbstab.elements.guards.barrier import Barrier
from rbstab.elements.guards.stop import Stop
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import motion_from_centre

HERE = Path(__file__).parent

WIDTH, HEIGHT = 640, 280

STYLE = """
    .card { fill: #ffffff; stroke: #d8dee4; }
    .body { fill: #0072b2; fill-opacity: 0.14; stroke: #0072b2; stroke-width: 2; }
    .line { fill: none; stroke: #24292f; stroke-width: 1.6; stroke-linecap: round; }
    .thin { fill: none; stroke: #6e7781; stroke-width: 1; }
    .dash { fill: none; stroke: #6e7781; stroke-width: 1.2; stroke-dasharray: 5 4; }
    .part { fill: none; stroke: #d55e00; stroke-width: 2.2; stroke-linejoin: round; }
    .force { fill: none; stroke: #009e73; stroke-width: 3; }
    .blue { fill: none; stroke: #0072b2; stroke-width: 2.2; }
    .dot { fill: #24292f; }
    .forcehead { fill: #009e73; } .bluehead { fill: #0072b2; } .head { fill: #6e7781; }
    text { font: 15px "Helvetica Neue", Arial, "DejaVu Sans", sans-serif; fill: #24292f; }
    .symbol { font: italic 18px Georgia, "DejaVu Serif", serif; }
    .small { font-size: 13px; fill: #57606a; }
    .part-text { fill: #b14a00; } .force-text { fill: #00785a; } .blue-text { fill: #005f96; }
    @media (prefers-color-scheme: dark) {
      .card { fill: #0d1117; stroke: #30363d; }
      .body { fill: #56b4e9; fill-opacity: 0.2; stroke: #56b4e9; }
      .line { stroke: #e6edf3; } .dot { fill: #e6edf3; } text { fill: #e6edf3; }
      .thin, .dash { stroke: #9198a1; } .head { fill: #9198a1; } .small { fill: #9198a1; }
      .part { stroke: #f0883e; } .part-text { fill: #f0a060; }
      .force { stroke: #3fd0a2; } .forcehead { fill: #3fd0a2; } .force-text { fill: #3fd0a2; }
      .blue { stroke: #56b4e9; } .bluehead { fill: #56b4e9; } .blue-text { fill: #79c0ff; }
    }
"""

Point = tuple[float, float]


def path(points: list[Point], kind: str) -> str:
    """Return a line through points."""
    return f'<path class="{kind}" d="M{" L".join(f"{x:.1f},{y:.1f}" for x, y in points)}"/>'


def text(where: Point, words: str, kind: str = "", anchor: str = "middle") -> str:
    """Return words at a point."""
    x, y = where
    return f'<text class="{kind}" x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{words}</text>'


def dot(where: Point, size: float = 4.0) -> str:
    """Return a filled circle."""
    return f'<circle class="dot" cx="{where[0]:.1f}" cy="{where[1]:.1f}" r="{size}"/>'


def along(start: Point, end: Point, shape: list[Point]) -> list[Point]:
    """Return the points of a shape, given along and beside a line in pixels, on the drawing."""
    direction = np.subtract(end, start) / np.hypot(*np.subtract(end, start))
    beside = np.array([-direction[1], direction[0]])
    return [tuple(np.asarray(start) + a * direction + b * beside) for a, b in shape]


def length(start: Point, end: Point) -> float:
    """Return the distance of two points, in pixels."""
    return float(np.hypot(*np.subtract(end, start)))


def arrow(start: Point, end: Point, kind: str, head: str, size: float = 11.0) -> str:
    """Return an arrow."""
    whole = length(start, end)
    tip = along(start, end, [(whole - size, 0.42 * size), (whole, 0), (whole - size, -0.42 * size)])
    corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in tip)
    shaft = along(start, end, [(0, 0), (whole - size + 1, 0)])
    return path(shaft, kind) + f'<polygon class="{head}" points="{corners}"/>'


def coil(start: Point, end: Point, offset: float = 0.0, turns: int = 7) -> str:
    """Return a spring between two points, beside their line by an offset."""
    whole = length(start, end)
    a = np.linspace(0.22 * whole, 0.78 * whole, 2 * turns + 1)
    b = offset + 9.0 * np.array([0, *([1, -1] * turns)[:-1], 0])
    inner = [(0.22 * whole, offset), *zip(a, b, strict=True), (0.78 * whole, offset)]
    ends = (
        [(0, 0), (0.14 * whole, 0), (0.14 * whole, offset)],
        [(0.86 * whole, offset), (0.86 * whole, 0), (whole, 0)],
    )
    return path(along(start, end, [*ends[0], *inner, *ends[1]]), "part")


def damper(start: Point, end: Point, offset: float = 0.0) -> str:
    """Return a damper between two points, beside their line by an offset."""
    whole, half = length(start, end), 8.0
    left, right = 0.42 * whole, 0.6 * whole
    piston = [(0.14 * whole, offset), (0.5 * whole, offset)]
    plate = [(0.5 * whole, offset - half + 2.5), (0.5 * whole, offset + half - 2.5)]
    cup = [
        (left, offset - half),
        (right, offset - half),
        (right, offset + half),
        (left, offset + half),
    ]
    rod = [(right, offset), (0.86 * whole, offset)]
    joints = [[(at * whole, 0), (at * whole, offset)] for at in (0.14, 0.86)]
    return "".join(
        path(along(start, end, line), "part") for line in (piston, plate, cup, rod, *joints)
    )


def ground(start: Point, end: Point) -> str:
    """Return a line that is fixed in space: hatched on its left, seen from its start."""
    whole = length(start, end)
    hatches = [along(start, end, [(a, 0), (a - 9, -11)]) for a in np.arange(9, whole + 1, 11)]
    return path([start, end], "line") + "".join(path(hatch, "thin") for hatch in hatches)


def box(centre: Point, angle: float, size: Point) -> str:
    """Return the body: a box with its centre of gravity, turned by an angle in degrees."""
    (x, y), (w, h) = centre, size
    frame = f'x="{x - w / 2}" y="{y - h / 2}" width="{w}" height="{h}" rx="12"'
    turned = f'<rect class="body" {frame} transform="rotate({angle} {x} {y})"/>'
    quarters = f"M{x},{y} h7 a7,7 0 0 1 -7,7 z M{x},{y} h-7 a7,7 0 0 1 7,-7 z"
    centre_mark = (
        f'<circle class="line" cx="{x}" cy="{y}" r="7"/><path class="dot" d="{quarters}"/>'
    )
    return turned + centre_mark


def spring() -> str:
    """Draw a spring with its damper on the line from the anchor to a point of the body."""
    centre, p, anchor = (150, 160), (222, 112), (548, 60)
    middle = along(p, anchor, [(length(p, anchor) / 2, 0)])[0]
    size = along(p, anchor, [(0, -46), (length(p, anchor), -46)])
    return "".join(
        [
            ground((548, 18), (548, 118)),
            box(centre, -16, (170, 130)),
            arrow(centre, p, "dash", "head"),
            coil(p, anchor, -15),
            damper(p, anchor, 17),
            path([size[0], along(p, anchor, [(0, -10)])[0]], "thin"),
            arrow(size[0], size[1], "thin", "head", 8),
            arrow(size[1], size[0], "thin", "head", 8),
            arrow(p, along(p, anchor, [(62, 0)])[0], "force", "forcehead", 14),
            dot(p),
            dot(anchor),
            text(along(p, anchor, [(length(p, anchor) / 2, -55)])[0], "ℓ", "symbol"),
            text((middle[0] - 36, middle[1] - 26), "k", "symbol part-text"),
            text((middle[0] + 30, middle[1] + 50), "c", "symbol part-text"),
            text((572, 66), "anchor", anchor="start"),
            text((178, 128), "p", "symbol"),
            text((255, 140), "force", "force-text", "start"),
            text((150, 192), "body"),
            text((320, 232), "pulls along the line if it is longer than ℓ₀,", "small", "start"),
            text((320, 251), "pushes if it is shorter", "small", "start"),
        ]
    )


def tie() -> str:
    """Draw a tie: springs and dampers along all axes, from the anchor to a point of the body."""
    centre, p, anchor = (196, 108), (282, 138), (332, 186)
    return "".join(
        [
            box(centre, -12, (170, 100)),
            arrow(centre, p, "dash", "head"),
            coil(p, (500, 138), -13, 6),
            damper(p, (500, 138), 15),
            ground((500, 92), (500, 172)),
            coil(p, (282, 252), 13, 4),
            damper(p, (282, 252), -15),
            ground((332, 252), (232, 252)),
            path([(anchor[0] - 8, anchor[1]), (anchor[0] + 8, anchor[1])], "line"),
            path([(anchor[0], anchor[1] - 8), (anchor[0], anchor[1] + 8)], "line"),
            arrow(anchor, p, "blue", "bluehead"),
            dot(p),
            text((246, 110), "p", "symbol"),
            text((320, 168), "e", "symbol blue-text", "start"),
            text((346, 192), "anchor: no force here", anchor="start"),
            text((400, 104), "K_c, L_c", "part-text"),
            text((180, 146), "body"),
            text((376, 228), "along every axis, the third one too:", "small", "start"),
            text((376, 247), "K_c and L_c may be full matrices", "small", "start"),
        ]
    )


def embedded() -> str:
    """Draw an embedded tie: two springs with dampers in a row, and its state D between them."""
    centre, p, D, wall = (150, 118), (236, 148), (386, 148), (536, 148)
    return "".join(
        [
            box(centre, -12, (170, 100)),
            arrow(centre, p, "dash", "head"),
            coil(p, D, -13, 6),
            path([p, (236, 216), (280, 216)], "part"),
            damper((236, 216), (536, 216)),
            path([(490, 216), (536, 216)], "part"),
            coil(D, wall, -13, 6),
            damper(D, wall, 15),
            ground((536, 92), (536, 236)),
            dot(p),
            dot(D, 5.5),
            text((200, 120), "p", "symbol"),
            text((386, 132), "D", "symbol blue-text"),
            text((311, 116), "K_c", "part-text"),
            text((461, 116), "K_d", "part-text"),
            text((462, 190), "L_d", "part-text"),
            text((386, 199), "L_c", "part-text"),
            text((134, 156), "body"),
            text((320, 264), "along every axis: D follows the point p slowly", "small"),
        ]
    )


def plane(origin: Point, curve: np.ndarray, line: list[Point], words: tuple[str, str]) -> str:
    """Draw a motion in the plane of E and F, with the surface s = 0 and what it is called."""
    x, y = origin
    placed = [(x + 120.0 * E, y - 80.0 * F) for E, F in curve]
    surface = [(x + 120.0 * E, y - 80.0 * F) for E, F in line]
    name, caption = words
    return "".join(
        [
            path([(x - 130, y), (x + 130, y)], "thin"),
            path([(x, y + 92), (x, y - 92)], "thin"),
            path(surface, "blue"),
            path(placed, "part"),
            dot(placed[0]),
            text((x + 136, y + 5), "E", "symbol", "start"),
            text((x + 8, y - 84), "F", "symbol", "start"),
            text((x - 126, y - 76), name, "blue-text", "start"),
            text((x, 264), caption, "small"),
        ]
    )


def sliding() -> str:
    """Draw what a mass does under a sliding tie on both surfaces: it bounces, or it slides."""
    # A mass under -sgn E: parabolas E = 0.9 - F²/2, and their mirror images.
    F = np.linspace(0.0, -np.sqrt(1.8), 30) * 0.75
    E = 0.9 - F * F / (2 * 0.75**2)
    first = np.array([E, F]).T
    around = np.concatenate([first, -first[::-1] * [1, -1], -first, first[::-1] * [1, -1]])
    # Under -sgn(F + 2E) the mass passes E = 0.9 at rest, and meets the line before E = 0.
    slope = 1.6
    meets = next(k for k in range(len(F)) if F[k] <= -slope * E[k])
    E_meet = float(E[meets])
    slid = np.concatenate([first[: meets + 1], [[E_meet, -slope * E_meet], [0.0, 0.0]]])
    line = [(-0.55, 0.88), (0.55, -0.88)]
    return plane(
        (165, 126), around, [(0.0, -1.1), (0.0, 1.1)], ("s = E", "it crosses: bounces without end")
    ) + plane((475, 126), slid, line, ("s = F + κE", "it arrives, and slides to E = 0"))


def attitude() -> str:
    """Draw the two frames, the couple between them, and the energy over the angle."""
    origin, angle, reach = (150, 205), np.radians(38), 128
    turned = [
        (origin[0] + reach * np.cos(a), origin[1] - reach * np.sin(a))
        for a in (angle, angle + np.pi / 2)
    ]
    arc = [
        (origin[0] + 84 * np.cos(a), origin[1] - 84 * np.sin(a))
        for a in np.linspace(0.03, angle - 0.04, 20)
    ]
    couple = [
        (origin[0] + 108 * np.cos(a), origin[1] - 108 * np.sin(a))
        for a in np.linspace(angle, 0.1, 20)
    ]
    K = 20.0 * np.eye(3)
    angles = np.linspace(-np.pi, np.pi, 121)
    energy = energies(AttitudeSpring(name="", K=K, L=K), angles, 0)
    return "".join(
        [
            arrow(origin, (origin[0] + reach + 22, origin[1]), "dash", "head"),
            arrow(origin, (origin[0], origin[1] - reach - 22), "dash", "head"),
            arrow(origin, turned[0], "blue", "bluehead"),
            arrow(origin, turned[1], "blue", "bluehead"),
            path(arc, "part"),
            path(couple[:-2], "force"),
            arrow(couple[-3], couple[-1], "force", "forcehead", 14),
            dot(origin),
            text((245, 184), "φ", "symbol part-text"),
            text((264, 152), "couple", "force-text", "start"),
            text((300, 226), "inertial frame", "small", "end"),
            text((66, 88), "body", "blue-text"),
            plot(angles, energy, "energy", ["-π", "0", "π"], "angle φ, about any axis"),
            text((477, 257), "smooth for all rotations; largest at a half turn", "small"),
        ]
    )


def guard() -> str:
    """Draw the energy of a guard over θ2, with what a motion can reach."""
    angles = np.linspace(-1.4, 1.4, 161)
    energy = energies(Barrier(name="", stiffness=1.0, outer_stiffness=0.0), angles, 1)
    left, right, floor, top = 90.0, 550.0, 212.0, 40.0
    x = left + (right - left) * (angles / np.pi + 0.5)
    shown = energy < 8.0
    y = floor - 20.0 * energy
    level = 3.4
    reach = float(np.interp(level, energy[80:], x[80:]))
    mirrored = left + right - reach
    at = floor - 20.0 * level
    return "".join(
        [
            ground((left, floor + 8), (left, top)),
            ground((right, top), (right, floor + 8)),
            path([(left, floor), (right, floor)], "line"),
            path([(mirrored, at), (reach, at)], "blue"),
            path([(mirrored, at), (mirrored, floor)], "dash"),
            path([(reach, at), (reach, floor)], "dash"),
            path(list(zip(x[shown], y[shown], strict=True)), "part"),
            text((320, at - 9), "all the energy that the motion has", "blue-text"),
            text((320, floor - 22), "θ2 stays in here"),
            text((left, floor + 28), "-π/2", "symbol"),
            text((right, floor + 28), "π/2", "symbol"),
            text((320, floor + 28), "θ2 = 0", "symbol"),
            text((320, 264), "½ k tan² θ2 has no end: no motion reaches θ2 = ±π/2", "small"),
        ]
    )


def stop() -> str:
    """Draw θ2 over time: it hops at a stop, and then rests there."""
    bone = Stop(name="", angle=1.0, restitution=0.65)
    left, right, wall, floor, load = 70.0, 590.0, 70.0, 220.0, 2.0
    t, angle, rate, hops = 0.0, 0.0, 2.2, []
    # Under a load of constant acceleration; with a mobility of 1 an impulse is a jump of the rate.
    for _ in range(12):
        remaining = bone.angle - angle
        flight = (-rate + np.sqrt(rate * rate + 2.0 * load * remaining)) / load
        times = np.linspace(0.0, flight, 40)
        hops += zip(t + times, angle + rate * times + 0.5 * load * times**2, strict=True)
        t, angle, rate = t + flight, bone.angle, rate + load * flight
        rate += bone.impulse(rate, 1.0)
    end = 1.35 * t
    hops.append((end, bone.angle))
    curve = [(left + (right - left) * a / end, floor - (floor - wall) * float(b)) for a, b in hops]
    rest = left + (right - left) * t / end
    return "".join(
        [
            ground((left, wall), (right, wall)),
            path([(left, floor + 18), (left, wall - 22)], "thin"),
            arrow((left, floor + 18), (right + 20, floor + 18), "thin", "head", 8),
            path(curve, "part"),
            path([(rest, wall + 4), (rest, floor + 18)], "dash"),
            arrow((rest + 70, wall), (rest + 70, wall + 52), "force", "forcehead", 14),
            text((left - 10, wall + 6), "θ_e", "symbol", "end"),
            text((left - 10, wall - 24), "θ2", "symbol", "end"),
            text((right + 14, floor + 38), "time", "small", "end"),
            text((rest + 84, wall + 40), "couple τ", "force-text", "start"),
            text((rest + 8, floor + 6), "rest", "", "start"),
            text((300, 264), "each impact makes the rate -e times that before", "small"),
            text((300, 30), "infinitely many hops take a finite time", "small"),
        ]
    )


def energies(element: Element, angles: np.ndarray, axis: int) -> np.ndarray:
    """Return the energy that an element stores at angles Θ about one axis."""
    body, stored = Body(1.0, np.eye(3), np.zeros(3)), []
    for angle in angles:
        Z = np.zeros(12)
        Z[axis] = angle
        stored.append(element.stored(motion_from_centre(body, np.zeros(3), Z), NO_STATE))
    return np.array(stored)


def plot(x: np.ndarray, y: np.ndarray, name: str, ticks: list[str], label: str) -> str:
    """Return a small diagram of a curve over a symmetric range."""
    left, right, floor, top = 362.0, 592.0, 195.0, 50.0
    across = left + (right - left) * (x - x[0]) / (x[-1] - x[0])
    up = floor - (floor - top) * y / y.max()
    middle = (left + right) / 2
    return "".join(
        [
            path([(left, floor), (right, floor)], "line"),
            path([(middle, floor), (middle, top - 8)], "dash"),
            path(list(zip(across, up, strict=True)), "part"),
            text((left + 4, top - 12), name, "part-text", "start"),
            *(
                text((a, floor + 21), t, "symbol")
                for a, t in zip((left, middle, right), ticks, strict=True)
            ),
            text((middle, floor + 41), label, "small"),
        ]
    )


FIGURES: dict[str, tuple[str, Callable[[], str]]] = {
    "spring": ("A spring and a damper on the line from an anchor to a point of the body", spring),
    "tie": ("A point of the body, tied to an anchor by springs and dampers along all axes", tie),
    "embedded": ("A tie with a point D of its own between two springs with dampers", embedded),
    "sliding": ("A mass under a sliding tie: on s = E it bounces, on a slope it slides", sliding),
    "attitude": ("A couple turns the body frame back to the inertial frame", attitude),
    "guard": ("The energy of a guard grows without end at both ends of the range", guard),
    "stop": ("An angle hops at its stop, each hop lower than the last, and then rests", stop),
}


def whole(content: str, width: int, height: int, title: str) -> str:
    """Return the whole SVG file of a drawing on a card."""
    content = content.replace("/><", "/>\n<").replace("</text><", "</text>\n<")
    card = f'<rect class="card" x="1" y="1" width="{width - 2}" height="{height - 2}" rx="8"/>'
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" '
        f'height="{height}" role="img">\n<title>{title}</title>\n<style>{STYLE}</style>\n'
        f"{card}\n{content}\n</svg>\n"
    )


def drawing(title: str, content: str) -> str:
    """Return a whole SVG file, on a card of its own: it reads on pages of any colour."""
    card = f'<rect class="card" x="1" y="1" width="{WIDTH - 2}" height="{HEIGHT - 2}" rx="8"/>'
    content = content.replace("/><", "/>\n<").replace("</text><", "</text>\n<")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" '
        f'height="{HEIGHT}" role="img">\n<title>{title}</title>\n<style>{STYLE}</style>\n'
        f"{card}\n{content}\n</svg>\n"
    )


def drawings() -> dict[str, str]:
    """Return the text of each file by its name."""
    return {
        f"elements_{name}.svg": drawing(title, draw()) for name, (title, draw) in FIGURES.items()
    }


if __name__ == "__main__":
    for name, svg in drawings().items():
        (HERE / name).write_text(svg, encoding="utf-8")
