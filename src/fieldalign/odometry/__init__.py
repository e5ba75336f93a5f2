"""Odometry: a stream of scans, each laid on a map that grows."""

from .odometry import Odometry
from .reason import Tracking
from .result import OdometryResult
from .settings import OdometrySettings

__all__ = ["Odometry", "OdometryResult", "OdometrySettings", "Tracking"]
