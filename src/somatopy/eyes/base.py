"""The Eye contract: from a body's reading to where the marker is, or that it is not seen."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from somatopy.percept import Reading, Sighting

__all__ = ["Eye"]


@runtime_checkable
class Eye(Protocol):
    """Finds the marker. Pure: the same reading gives the same answer."""

    def look(self, reading: Reading) -> Sighting | None:
        """The marker's pixel, tag and area, or None on a miss."""
        ...
