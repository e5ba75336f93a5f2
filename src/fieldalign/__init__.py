"""fieldalign: the rigid motion between two scans, found by aligning their distance fields."""

import logging

from . import fields
from .clouds.cloud import PointCloud
from .clouds.files import read_cloud, read_clouds, write_cloud
from .clouds.thinning import thin
from .dof import Dof
from .errors import ArgumentError, CloudFileError, FieldalignError, FieldError, MissingExtraError
from .inspection import Deviation, deviation
from .prepare import prepare
from .prepared import PreparedCloud
from .register import register
from .result import RegistrationResult
from .settings import PRESETS, Settings
from .verdict import Evidence, Freedom, Reason
from .verify import verify

__version__ = "0.1.0"
__all__ = [
    "PRESETS",
    "ArgumentError",
    "CloudFileError",
    "Deviation",
    "Dof",
    "Evidence",
    "FieldError",
    "FieldalignError",
    "Freedom",
    "MissingExtraError",
    "PointCloud",
    "PreparedCloud",
    "Reason",
    "RegistrationResult",
    "Settings",
    "deviation",
    "fields",
    "prepare",
    "read_cloud",
    "read_clouds",
    "register",
    "thin",
    "verify",
    "write_cloud",
]

logging.getLogger(__name__).addHandler(logging.NullHandler())
