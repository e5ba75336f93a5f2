"""Sequences of scans: a folder or a bag becomes frames, read one at a time."""

from .read import read_sequence
from .sequence import Frame, Sequence

__all__ = ["Frame", "Sequence", "read_sequence"]
