"""Counts in sentences and tables that people read."""

from operator import index
from typing import SupportsIndex

FIRST_SEPARATED = 10_000
"""The smallest count with separators: four digits are read at a glance without one."""


def grouped(count: SupportsIndex) -> str:
    """Return a count with commas between thousands: "9999", "10,000", "1,048,576".

    Not for what programs read: numbers of members, commands, CSV and JSON.
    """
    whole = index(count)
    return f"{whole:,}" if abs(whole) >= FIRST_SEPARATED else str(whole)
