"""Distance fields: the protocol, and the fields of points, of a mesh, of a volume, and of any function."""

from .callable import CallableField
from .files import read_field
from .mesh import MeshField
from .points import PointField
from .protocol import DistanceField, FieldSample, sampled
from .spread import spread_over
from .volume import VolumeField

__all__ = [
    "CallableField",
    "DistanceField",
    "FieldSample",
    "MeshField",
    "PointField",
    "VolumeField",
    "read_field",
    "sampled",
    "spread_over",
]
