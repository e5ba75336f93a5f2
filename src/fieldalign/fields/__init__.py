"""Distance fields: the protocol, and the field of a point cloud."""

from .points import PointField
from .protocol import DistanceField, FieldSample, sampled

__all__ = ["DistanceField", "FieldSample", "PointField", "sampled"]
