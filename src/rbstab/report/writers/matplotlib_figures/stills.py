"""Stills of an animation: a row of poses of the body, as the view of an HTML page shows it.

The camera, the light and the colours are those of `scene.js` and `motions.js`.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from io import BytesIO
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure as Drawing
from scipy.spatial.transform import Rotation

from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Animation
from rbstab.report.writers.matplotlib_figures.renderer import WIDTH, style

AZIMUTH, ELEVATION, FOCUS = -0.95, 0.32, 1.55
"""The view, rad, and the focal length of the camera, as of `scene.js`."""

CONTACT, ANCHOR, PULLS, PUSHES = "#D55E00", "#009E73", "#CC3311", "#0077BB"
BODY = np.array([122, 143, 166]) / 255
CENTRE = "#1C2024"
SLACK, AXIS = "#7F7F7F", "#7F7F7F"
SUN = np.array([0.35, -0.55, 0.9]) / np.linalg.norm([0.35, -0.55, 0.9])

TRIAD = 0.16
"""Length of the longest arrow of the inertial axes, in."""

ARROW = {
    "arrowstyle": "-|>",
    "color": AXIS,
    "linewidth": 0.7,
    "mutation_scale": 5,
    "shrinkA": 0,
    "shrinkB": 0,
}

DASHED = (0, (2.5, 1.8))

MAX_BAR = 0.45
"""Length of the longest bar that shows the scale, in."""

MARGIN = 0.06
"""Space around the body, as a share of the width of a pose."""

MIN_HEIGHT, MAX_HEIGHT = 0.7, 1.7
"""Smallest and largest height of a pose, in; four rows fit on an A4 page, with their captions."""

GAP = 0.06
"""Space between poses, in."""

EDGE = 0.01
"""Space around all poses, so that no frame is cut, in."""

FRAME = "#DDDDDD"

TEXT = 0.2
"""Height of the time below a pose, in."""

NO_LOAD = 1e-6
"""An element with a smaller share of the largest load is drawn without load."""


@dataclass(frozen=True, eq=False)
class Camera:
    """A camera that looks at a point from a distance; the third axis points upwards.

    Args:
        middle: The point, shape (3,), m.
        distance: The distance, m.
    """

    middle: Array
    distance: float

    def project(self, points: Array) -> Array:
        """Return the places of points in the view and their depths, shape (n, 3)."""
        right = np.array([-np.sin(AZIMUTH), np.cos(AZIMUTH), 0.0])
        outward = np.array(
            [
                np.cos(ELEVATION) * np.cos(AZIMUTH),
                np.cos(ELEVATION) * np.sin(AZIMUTH),
                np.sin(ELEVATION),
            ]
        )
        offset = np.asarray(points) - self.middle
        depth = self.distance - offset @ outward
        across = offset @ np.column_stack([right, np.cross(outward, right)])
        return np.column_stack([across / depth[:, np.newaxis], depth])


def stills_png(
    animation: Animation, others: Iterable[Animation] = (), *, dpi: float = 200.0
) -> bytes:
    """Render the stills of an animation in a row, as PNG.

    Args:
        animation: The animation; `stills` are the indices of its times.
        others: The animations that are shown beside it: equal bodies have one scale.
        dpi: Dots per inch; the row is 170 mm wide.
    """
    buffer = BytesIO()
    with style():
        _row(animation, others).savefig(buffer, format="png", dpi=dpi)
    return buffer.getvalue()


def _row(animation: Animation, others: Iterable[Animation]) -> Drawing:
    equal = [animation, *(other for other in others if _has_equal_body(animation, other))]
    distance = max(_camera(each).distance for each in equal)
    camera, count = replace(_camera(animation), distance=distance), len(animation.stills)
    solids = [_corners(animation, frame) for frame in animation.stills]
    middle, size = _extent(animation, camera)
    width = (WIDTH - 2 * EDGE - (count - 1) * GAP) / count
    # Both directions have the same scale.
    scale = max(_scale_of(each, replace(_camera(each), distance=distance)) for each in equal)
    height = min(max(size[1] / scale, MIN_HEIGHT), MAX_HEIGHT)
    size = scale * np.array([width, height])
    whole = height + TEXT + EDGE
    row = Drawing(figsize=(WIDTH, whole))
    # The axes are placed here; the layout of the style would move them.
    row.set_layout_engine("none")
    FigureCanvasAgg(row)
    for number, (frame, corners) in enumerate(zip(animation.stills, solids, strict=True)):
        left = EDGE + number * (width + GAP)
        axes = row.add_axes((left / WIDTH, TEXT / whole, width / WIDTH, height / whole))
        _frame(axes, middle, size)
        _pose(axes, animation, camera, frame, corners)
        time = f"t = {animation.times[frame]:.3g} s"
        row.text((left + 0.5 * width) / WIDTH, 0.3 * TEXT / whole, time, ha="center", fontsize=8)
        if number == count - 1:
            _scale(axes, camera, size[0], width)
        if number == 0:
            _triad(axes, camera, np.array([width, height]), corners)
    return row


def _has_equal_body(one: Animation, other: Animation) -> bool:
    """Return whether two animations with stills show the same body."""
    return bool(other.stills) and np.array_equal(one.solid.vertices, other.solid.vertices)


def _extent(animation: Animation, camera: Camera) -> tuple[Array, Array]:
    """Return the middle and the size of what the poses show, in the units of the view."""
    solids = [_corners(animation, frame) for frame in animation.stills]
    drawn = np.concatenate([*solids, _path(animation), _fixed_points(animation)])
    places = camera.project(drawn)[:, :2]
    low, high = places.min(axis=0), places.max(axis=0)
    size = np.maximum(high - low, 0.25 * float((high - low).max())) * (1 + 2 * MARGIN)
    return 0.5 * (low + high), size


def _scale_of(animation: Animation, camera: Camera) -> float:
    """Return the units of the view for an inch with which the poses just have room."""
    count = len(animation.stills)
    width = (WIDTH - 2 * EDGE - (count - 1) * GAP) / count
    _, size = _extent(animation, camera)
    return float(max(size[0] / width, size[1] / MAX_HEIGHT))


def _frame(axes: Axes, middle: Array, size: Array) -> None:
    """Set the same part of the view for all poses, in a thin frame."""
    axes.set_xlim(middle[0] - 0.5 * size[0], middle[0] + 0.5 * size[0])
    axes.set_ylim(middle[1] - 0.5 * size[1], middle[1] + 0.5 * size[1])
    axes.set(xticks=[], yticks=[])
    for side in axes.spines.values():
        side.set(color=FRAME, linewidth=0.6)


def _pose(axes: Axes, animation: Animation, camera: Camera, frame: int, corners: Array) -> None:
    """Draw the body at a time, the path of its contact point, its anchor and its elements."""
    path = camera.project(_path(animation))[:, :2]
    axes.plot(*path[frame:].T, color=CONTACT, alpha=0.3, linewidth=0.6, zorder=1)
    _solid(axes, animation, camera, corners)
    axes.plot(*path[: frame + 1].T, color=CONTACT, linewidth=0.9, zorder=3)
    here = _path(animation)[frame]
    lever = (animation.positions[frame], here)
    _segment(axes, camera, lever, color=CONTACT)
    if animation.anchor is not None:
        _segment(axes, camera, (animation.anchor, here), color=ANCHOR, linewidth=1.4)
        _disc(axes, camera, animation.anchor, ANCHOR, 4.5)
    _disc(axes, camera, animation.positions[frame], CENTRE, 2.8)
    _disc(axes, camera, here, CONTACT, 3.6)
    largest = max((float(np.abs(tie.loads).max()) for tie in animation.ties), default=0.0) or 1.0
    turn = _turn(animation, frame)
    for tie in animation.ties:
        load = float(tie.loads[frame])
        share = abs(load) / largest
        slack = not share >= NO_LOAD
        colour = SLACK if slack else PULLS if load > 0 else PUSHES
        end = animation.positions[frame] + turn.apply(tie.point)
        width = 0.7 + (0.0 if slack else 1.8 * np.sqrt(share))
        look = {"color": colour, "linewidth": width, "linestyle": DASHED if slack else "-"}
        _segment(axes, camera, (tie.anchor, end), **look)
        _disc(axes, camera, tie.anchor, colour, 2.4)


def _solid(axes: Axes, animation: Animation, camera: Camera, corners: Array) -> None:
    """Draw the triangles of the body, the farthest first."""
    triangles = corners[animation.solid.triangles]
    places = camera.project(corners)[animation.solid.triangles]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(sizes > 0, sizes, 1.0)
    light = 0.55 + 0.45 * (normals @ SUN).clip(min=0) + 0.12 * normals[:, 2].clip(min=0)
    tints = (BODY * light[:, np.newaxis] * 1.15).clip(max=1.0)
    order = np.argsort(-places[..., 2].mean(axis=1))
    # Of a closed shape only the triangles that look towards the camera are seen.
    along, across = places[:, 1, :2] - places[:, 0, :2], places[:, 2, :2] - places[:, 0, :2]
    faces = along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0] > 0
    order = order[faces[order]]
    axes.add_collection(
        PolyCollection(
            list(places[order][..., :2]),
            facecolors=tints[order],
            # Without a border in the same colour, the background shows between triangles.
            edgecolors=tints[order],
            linewidths=0.3,
            zorder=2,
        ),
        autolim=False,
    )


def _segment(axes: Axes, camera: Camera, ends: tuple[Array, Array], **look: Any) -> None:
    """Draw a line between two points in front of the body, in a look of matplotlib."""
    places = camera.project(np.array(ends))[:, :2]
    axes.plot(*places.T, **({"linewidth": 1.1, "zorder": 4} | look))


def _disc(axes: Axes, camera: Camera, point: Array, colour: str, size: float) -> None:
    place = camera.project(point[np.newaxis])[0]
    axes.plot(
        place[0],
        place[1],
        marker="o",
        markersize=size,
        color=colour,
        markeredgecolor="white",
        markeredgewidth=0.6,
        zorder=5,
    )


def _triad(axes: Axes, camera: Camera, size: Array, corners: Array) -> None:
    """Draw the directions of the inertial axes in the emptiest corner of a pose.

    Args:
        axes: The axes of the pose.
        camera: The camera.
        size: The width and height of the pose, in.
        corners: The vertices of the body, shape (n, 3), m.
    """
    ends = camera.project(camera.middle + 0.01 * camera.distance * np.eye(3))[:, :2]
    ends = ends / np.abs(ends).max() * TRIAD
    body = axes.transLimits.transform(camera.project(corners)[:, :2]) * size
    # The arrows point upwards and to the right of their common origin, but x1 a little downwards.
    places = [np.array([x, y]) for y in (0.12, size[1] - 0.38) for x in (0.12, size[0] - 0.38)]
    centres = [place + 0.13 for place in places]
    distances = [np.abs(body - centre).max(axis=1).min() for centre in centres]
    origin = places[int(np.argmax(distances))]
    for number, end in enumerate(ends):
        axes.annotate(
            "",
            tuple((origin + end) / size),
            tuple(origin / size),
            xycoords="axes fraction",
            arrowprops=ARROW,
        )
        x, y = (origin + 1.45 * end) / size
        axes.text(
            x,
            y,
            f"x{'₁₂₃'[number]}",
            transform=axes.transAxes,
            color=AXIS,
            fontsize=6,
            ha="center",
            va="center",
        )


def _scale(axes: Axes, camera: Camera, size: float, width: float) -> None:
    """Draw a bar of a round length, as it is at the middle of the view, in the lower right corner.

    Args:
        axes: The axes of a pose.
        camera: The camera.
        size: The width of the pose, in the units of its view.
        width: Its width, in.
    """
    # A metre has 1 / distance in the view.
    longest = MAX_BAR * size / width * camera.distance
    power = 10.0 ** np.floor(np.log10(longest))
    length = next(factor * power for factor in (5, 2, 1) if factor * power <= longest)
    share = length / camera.distance / size
    right, low = 1 - 0.06 / width, 0.05
    look: dict[str, Any] = {"transform": axes.transAxes, "color": AXIS}
    axes.plot([right - share, right], [low, low], linewidth=0.9, **look)
    axes.text(right, low + 0.02, f"{length:.1g} m", fontsize=6, ha="right", va="bottom", **look)


def _camera(animation: Animation) -> Camera:
    """Return the camera at the default view of `motions.js`."""
    places = np.concatenate([animation.positions, _fixed_points(animation)])
    low, high = places.min(axis=0), places.max(axis=0)
    lengths = np.linalg.norm(animation.solid.vertices, axis=1)
    reach = max(float(lengths.max()), float(np.linalg.norm(animation.contact_point)))
    size = reach + 0.5 * float(np.linalg.norm(high - low))
    return Camera(0.5 * (low + high), 1.02 * size * float(np.hypot(1.0, 2 * FOCUS)))


def _fixed_points(animation: Animation) -> Array:
    """Return the anchors, shape (n, 3), m."""
    anchors = [tie.anchor for tie in animation.ties]
    if animation.anchor is not None:
        anchors.append(animation.anchor)
    return np.array(anchors).reshape(-1, 3)


def _turn(animation: Animation, frame: int) -> Rotation:
    return Rotation.from_quat(animation.rotations[frame], scalar_first=True)


def _corners(animation: Animation, frame: int) -> Array:
    """Return the vertices of the body at a time, shape (n, 3), m."""
    turn = _turn(animation, frame)
    corners: Array = animation.positions[frame] + turn.apply(animation.solid.vertices)
    return corners


def _path(animation: Animation) -> Array:
    """Return the contact point at all times, shape (n, 3), m."""
    turns = Rotation.from_quat(animation.rotations, scalar_first=True)
    path: Array = animation.positions + turns.apply(animation.contact_point)
    return path
