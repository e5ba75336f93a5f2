"""fieldalign: the rigid motion between two scans, found by aligning their distance fields."""

import logging

from . import fields
from .clouds.cloud import PointCloud
from .errors import ArgumentError, CloudFileError, FieldalignError, FieldError, MissingExtraError
from .prepared import PreparedCloud, prepare
from .register import register
from .result import Reason, RegistrationResult
from .settings import PRESETS, Settings

__version__ = "0.1.0"
__all__ = [
    "PRESETS",
    "ArgumentError",
    "CloudFileError",
    "FieldError",
    "FieldalignError",
    "MissingExtraError",
    "PointCloud",
    "PreparedCloud",
    "Reason",
    "RegistrationResult",
    "Settings",
    "fields",
    "prepare",
    "register",
]

logging.getLogger(__name__).addHandler(logging.NullHandler())
