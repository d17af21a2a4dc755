"""Figures as Vega-Lite specifications, for the page and for files.

A specification has all data. The page sets its signals: `ink`, `paper` and `grid` are its colours,
`hidden` the names of the curves that are not shown, and `now` the time of the cursor.
"""

import json
from textwrap import wrap

from rbstab.report.model.figure import Axis, Cells, Figure, Shares
from rbstab.report.writers.decimate import decimate
from rbstab.report.writers.vega.cells import HATCH, edges_of, picture, span_of, tints_of
from rbstab.report.writers.vega.domains import domains_of
from rbstab.report.writers.vega.legend import legend_of, legend_views
from rbstab.report.writers.vega.marks import BAR, JSON, layers_of

FONT = "Liberation Sans, Arimo, sans-serif"

INK = {"ink": "#1c2024", "paper": "#ffffff", "grid": "#e4e8ec"}
"""The colours of a figure on a light page."""

SINGLE_ROW, SEVERAL_ROWS = 240, 170
"""The height of a panel in pixels, where panels are in one row and in several."""

LONGEST_TITLE = 40
"""Characters in a line of the title of an axis."""

AROUND = 75
"""Pixels beside a panel for its axis."""

NUMBER = "format(datum.value, '.6~g')"
"""A number at a tick: written out up to a million."""

WITH_DEGREES = f"[{NUMBER}, format(datum.value * 180 / PI, '.3~g') + '°']"
"""An angle at a tick: in rad, and below that in degrees."""

INDEPENDENT_SCALES = dict.fromkeys(("fill", "stroke", "strokeDash", "shape"), "independent")
"""Each legend has scales of its own: maps may have one word in two colours."""

BESIDE_TOUCH = "event.pointerType != 'touch'"
"""Fingers scroll the page: they zoom by buttons."""


def specification(figure: Figure, *, width: float, for_page: bool = False) -> JSON:
    """Return a figure as a Vega-Lite specification.

    Args:
        figure: The figure.
        width: Its width in pixels.
        for_page: Whether the page draws it: it has the legend, and zooms.
    """
    figure = decimate(figure)
    columns = min(figure.columns, len(figure.panels))
    layers = [_layers(figure, number) for number in range(len(figure.panels))]
    panels = []
    for number, domain in enumerate(domains_of(figure, layers)):
        at = {side: _axis(getattr(figure.panels[number], side), domain[side]) for side in domain}
        if not for_page and "y" in figure.shared and number % columns:
            at["y"]["title"] = None
        panels.append(_panel(figure, number, layers[number], at))
        panels[-1]["width"] = max(width / columns - AROUND, 60)
        if figure.panels[number].square:
            panels[-1]["height"] = panels[-1]["width"]
    signals: JSON = INK | {"hidden": [], "now": -1}
    for number, panel in enumerate(figure.panels):
        for cells in (mark for mark in panel.marks if isinstance(mark, Cells)):
            signals["hatch"] = HATCH
            signals[f"image{number}"] = picture(cells, panel.x, panel.y)
    params: list[JSON] = [{"name": name, "value": value} for name, value in signals.items()]
    shared = {"x": "shared"} if figure.shares_time else {}
    view: JSON = {
        "concat": panels,
        "columns": columns,
        "spacing": 16,
        "resolve": {"scale": shared | {"fill": "independent"}},
    }
    if for_page:
        params += _zooms(figure)
    elif legend := legend_views(legend_of(figure), width):
        view = {"vconcat": [*legend, view], "spacing": 4, "resolve": {"scale": INDEPENDENT_SCALES}}
    return {"config": _config(), "params": params} | view


def _layers(figure: Figure, number: int) -> list[JSON]:
    """Return the layers of a panel, without the look of its axes."""
    panel = figure.panels[number]
    layers = [
        layer
        for mark in panel.marks
        for layer in (
            _map(figure, number, mark) if isinstance(mark, Cells) else layers_of(mark, panel)
        )
    ]
    if layers:
        return layers
    at = {side: {"field": side, "type": "quantitative"} for side in ("x", "y")}
    nothing = {"x": None, "y": None}
    mark = {"type": "point", "opacity": 0}
    return [{"data": {"values": [nothing]}, "mark": mark, "encoding": at}]


def _panel(figure: Figure, number: int, layers: list[JSON], at: JSON) -> JSON:
    """Return a panel with these layers and axes; its width is left open."""
    panel = figure.panels[number]
    high: float = SINGLE_ROW if len(figure.panels) <= figure.columns else SEVERAL_ROWS
    if any(isinstance(mark, Shares) for mark in panel.marks):
        high = BAR * (len(panel.y.categories) + 1)
    for layer in layers:
        for side in {"x", "y"} & {*layer["encoding"]}:
            layer["encoding"][side] |= at[side]
    layers[0]["name"] = f"p{number}_data"
    if figure.shares_time:
        layers.append(_cursor(at["x"]))
    view: JSON = {"name": f"p{number}", "height": high, "layer": layers}
    return view | ({"title": panel.title} if panel.title else {})


def _axis(axis: Axis, domain: tuple[float, float]) -> JSON:
    """Return the scale and the look of an axis."""
    scale: JSON = {"type": "linear", "domain": list(domain), "nice": False, "zero": False}
    number = WITH_DEGREES if axis.unit == "rad" else NUMBER
    look: JSON = {"labelExpr": number, "tickCount": 5, "labelOverlap": True}
    if axis.log:
        scale = {"type": "log", "domain": list(domain), "nice": False}
        # Its own format labels powers of ten first.
        look = {"format": "~g", "tickCount": 5, "labelOverlap": True}
    if axis.whole:
        look["tickMinStep"] = 1
    if axis.categories:
        look = {
            "values": list(range(len(axis.categories))),
            # An array of JSON is one of Vega's expression language.
            "labelExpr": f"{json.dumps(axis.categories)}[datum.value]",
            "grid": False,
            "ticks": False,
        }
    # One line as it is, several as a list: a long title would run into the other axis.
    lines = wrap(axis.text, LONGEST_TITLE)
    return {"scale": scale, "title": lines if len(lines) > 1 else axis.text or None, "axis": look}


def _map(figure: Figure, number: int, cells: Cells) -> list[JSON]:
    """Return the pictures of a map, and what carries its scale of colours."""
    panel = figure.panels[number]
    x, y = edges_of(cells.x, panel.x), edges_of(cells.y, panel.y)
    box = [{"x": x[0], "x2": x[-1], "y": y[0], "y2": y[-1]}]
    place = {side: {"field": side, "type": "quantitative"} for side in ("x", "y")}
    place |= {side: {"field": side} for side in ("x2", "y2")}
    style = {"type": "image", "aspect": False, "smooth": False, "clip": True}
    layers: list[JSON] = [
        {"data": {"values": box}, "mark": style | {"url": {"expr": name}}, "encoding": place}
        for name in ("hatch", f"image{number}")
    ]
    scale = cells.scale
    last = min(figure.columns, len(figure.panels)) - 1
    if scale.categories or (figure.shares_scale and number != last):
        return layers
    ends = list(span_of(cells))
    bar = {"orient": "right", "gradientThickness": 12, "labelExpr": NUMBER, "tickCount": 5}
    fill = {
        "field": "value",
        "type": "quantitative",
        "title": scale.text if figure.shares_scale or scale.text != panel.title else None,
        "scale": {
            "type": "log" if scale.log else "linear",
            "domain": ends,
            "range": tints_of(cells),
            "interpolate": "rgb",
            "nice": False,
        },
        "legend": bar,
    }
    carrier = {"type": "point", "filled": True, "size": 0, "opacity": 1}
    rows = [{"value": end} for end in ends]
    return [*layers, {"data": {"values": rows}, "mark": carrier, "encoding": {"fill": fill}}]


def _cursor(x: JSON) -> JSON:
    """Return the line at the time of the animations; it is not shown before they have one."""
    shown = {"condition": {"test": "now >= 0", "value": 0.65}, "value": 0}
    return {
        "data": {"values": [{}]},
        "mark": {"type": "rule", "strokeWidth": 1.5, "clip": True, "color": {"expr": "ink"}},
        "encoding": {
            "x": {"datum": {"expr": "now"}, "type": "quantitative", "scale": x["scale"]},
            "opacity": shown,
        },
    }


def _zooms(figure: Figure) -> list[JSON]:
    """Return the parameters that zoom and move: by the wheel with Ctrl, and by dragging."""
    how = {
        "type": "interval",
        "zoom": "wheel![event.ctrlKey]",
        "translate": f"[pointerdown[{BESIDE_TOUCH}], window:pointerup] > window:pointermove!",
        "clear": "dblclick",
    }
    views = [f"p{number}_data" for number in range(len(figure.panels))]
    zooms = [(f"zoom{number}", ["x", "y"], [view]) for number, view in enumerate(views)]
    return [
        {"name": name, "select": how | {"encodings": sides}, "bind": "scales", "views": targets}
        for name, sides, targets in ([("zoom", ["x"], views)] if figure.shares_time else zooms)
    ]


def _config() -> JSON:
    ink, grid = {"expr": "ink"}, {"expr": "grid"}
    text = {
        "labelColor": ink,
        "titleColor": ink,
        "labelFontSize": 11,
        "titleFontSize": 12,
        "titleFontWeight": "normal",
    }
    return {
        "font": FONT,
        "background": {"expr": "paper"},
        "padding": 4,
        "view": {"stroke": grid},
        "axis": text | {"gridColor": grid, "tickColor": ink, "domainColor": ink},
        "legend": text | {"labelLimit": 420},
        "title": {"color": ink, "fontSize": 12, "anchor": "start", "offset": 6, "frame": "group"},
        "aria": False,
        "mark": {"invalid": "break-paths-show-domains"},
        "style": {"cell": {"stroke": grid}},
    }
