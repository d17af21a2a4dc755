"""Labels of logarithmic axes in matplotlib: few enough not to overlap, and written out."""

import numpy as np
from matplotlib.ticker import LogFormatterSciNotation

LABELLED = (
    (999.0, (1,)),
    (12.0, (1, 3)),
    (8.0, (1, 2, 5)),
    (2.5, (1, 2, 4, 6)),
    (1.5, (1, 2, 3, 4, 6, 8)),
)
"""The first digits with a label, if the upper end of a logarithmic axis is at least so many times
the lower one."""

WRITTEN_OUT = (1e-4, 1e5)
"""Labels between these are numbers, such as 0.3, unless all labels are powers of ten."""


class FewMinorLabels(LogFormatterSciNotation):
    """So few labels between powers of ten that they do not overlap on an axis of any length."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the label of a position; "" for none."""
        assert self.axis is not None
        low, high = self.axis.get_view_interval()
        leading = _first_digit(x)
        labelled = next((some for span, some in LABELLED if high >= span * low), None)
        if labelled is not None and leading.is_integer() and leading not in labelled:
            return ""
        if labelled != LABELLED[0][1] and WRITTEN_OUT[0] <= low and high <= WRITTEN_OUT[1]:
            return f"{x:g}"
        return str(super().__call__(x, pos))

    def format_ticks(self, values: list[float]) -> list[str]:
        """Return the labels of all positions.

        On short axes matplotlib has ticks such as 2.2, 2.4, 2.6: every third one gets a label.
        """
        labels = list(super().format_ticks(values))
        if all(_first_digit(value).is_integer() for value in values):
            return labels
        return ["" if number % 3 else label for number, label in enumerate(labels)]


def _first_digit(x: float) -> float:
    """Return a positive number over its power of ten, without round-off."""
    return round(float(x / 10.0 ** np.floor(np.log10(x) + 1e-9)), 6)
