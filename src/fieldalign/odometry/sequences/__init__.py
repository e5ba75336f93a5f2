"""Sequences of scans: a folder or a bag becomes frames, read one at a time."""

from .point_cloud2 import cloud_of
from .read import read_sequence
from .sequence import Frame, Sequence

__all__ = ["Frame", "Sequence", "cloud_of", "read_sequence"]
