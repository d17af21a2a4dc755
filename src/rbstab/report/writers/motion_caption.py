"""The caption of the stills of a motion."""

from rbstab.report.model.document import Animation


def stills_caption(animation: Animation) -> str:
    """Return the caption of the stills of an animation."""
    parts = [
        f"Grey-blue: {animation.solid.words}",
        "black: centre of gravity",
        "orange: contact point, its path, and the rod to it from the centre of gravity",
    ]
    if animation.anchor is not None:
        parts.append("green: anchor and connector")
    if animation.ties:
        parts.append("red: element that pulls; blue: one that pushes; grey: one without load")
    return (
        f"Motion of {animation.title}: poses at the times shown. {'; '.join(parts)}. "
        "Arrows: inertial axes."
    )
