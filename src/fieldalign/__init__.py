"""fieldalign: the rigid motion between two scans, found by aligning their distance fields."""

import logging

from . import fields
from .assemble import assemble
from .assembly.assembly import Assembly
from .assembly.pair_result import PairResult
from .clouds.cloud import PointCloud
from .clouds.files import read_cloud, read_clouds, write_cloud
from .clouds.thinning import thin
from .dof import Dof
from .errors import ArgumentError, CloudFileError, FieldalignError, FieldError, MissingExtraError, RunError
from .evaluation import Evaluation, evaluate
from .inspection import Deviation, deviation
from .odometry import Odometry, OdometryResult, OdometrySettings, Tracking
from .odometry.localizer import Localization, Localizer
from .odometry.loops import ClosedLoops, close_loops
from .odometry.sequences import read_sequence
from .odometry.trajectory import Trajectory
from .odometry.trajectory_files import read_trajectory, write_trajectory
from .prepare import prepare
from .prepared import PreparedCloud
from .register import register
from .register_many import register_many
from .result import RegistrationResult
from .settings import PRESETS, Settings
from .verdict import Evidence, Freedom, Reason
from .verify import verify

__version__ = "0.1.0"
__all__ = [
    "PRESETS",
    "ArgumentError",
    "Assembly",
    "ClosedLoops",
    "CloudFileError",
    "Deviation",
    "Dof",
    "Evaluation",
    "Evidence",
    "FieldError",
    "FieldalignError",
    "Freedom",
    "Localization",
    "Localizer",
    "MissingExtraError",
    "Odometry",
    "OdometryResult",
    "OdometrySettings",
    "PairResult",
    "PointCloud",
    "PreparedCloud",
    "Reason",
    "RegistrationResult",
    "RunError",
    "Settings",
    "Tracking",
    "Trajectory",
    "assemble",
    "close_loops",
    "deviation",
    "evaluate",
    "fields",
    "prepare",
    "read_cloud",
    "read_clouds",
    "read_sequence",
    "read_trajectory",
    "register",
    "register_many",
    "thin",
    "verify",
    "write_cloud",
    "write_trajectory",
]

logging.getLogger(__name__).addHandler(logging.NullHandler())
