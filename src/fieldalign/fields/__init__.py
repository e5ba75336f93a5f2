"""Distance fields: the protocol, and the fields of a point cloud and of any function."""

from .callable import CallableField
from .points import PointField
from .protocol import DistanceField, FieldSample, sampled

__all__ = ["CallableField", "DistanceField", "FieldSample", "PointField", "sampled"]
