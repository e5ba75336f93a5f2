"""fieldalign: the rigid motion between two scans, found by aligning their distance fields.

Each name is imported when it is first asked for, so that `fieldalign --help` need not wait for NumPy.
"""

import logging
import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # for type checkers and editors: what _HOMES says
    from . import fields as fields
    from .assemble import assemble as assemble
    from .assembly.assembly import Assembly as Assembly
    from .assembly.pair_result import PairResult as PairResult
    from .clouds.cloud import PointCloud as PointCloud
    from .clouds.files import read_cloud as read_cloud
    from .clouds.files import read_clouds as read_clouds
    from .clouds.files import write_cloud as write_cloud
    from .clouds.thinning import thin as thin
    from .dof import Dof as Dof
    from .errors import ArgumentError as ArgumentError
    from .errors import CloudFileError as CloudFileError
    from .errors import FieldalignError as FieldalignError
    from .errors import FieldError as FieldError
    from .errors import MissingExtraError as MissingExtraError
    from .errors import RunError as RunError
    from .evaluation.evaluate import Evaluation as Evaluation
    from .evaluation.evaluate import evaluate as evaluate
    from .inspection import Deviation as Deviation
    from .inspection import deviation as deviation
    from .odometry import Odometry as Odometry
    from .odometry import OdometryResult as OdometryResult
    from .odometry import OdometrySettings as OdometrySettings
    from .odometry import Tracking as Tracking
    from .odometry.localizer import Localization as Localization
    from .odometry.localizer import Localizer as Localizer
    from .odometry.loops import ClosedLoops as ClosedLoops
    from .odometry.loops import close_loops as close_loops
    from .odometry.sequences import read_sequence as read_sequence
    from .odometry.trajectory import Trajectory as Trajectory
    from .odometry.trajectory_files import read_trajectory as read_trajectory
    from .odometry.trajectory_files import write_trajectory as write_trajectory
    from .prepare import prepare as prepare
    from .prepared import PreparedCloud as PreparedCloud
    from .register import register as register
    from .register_many import register_many as register_many
    from .result import RegistrationResult as RegistrationResult
    from .settings import PRESETS as PRESETS
    from .settings import Settings as Settings
    from .verdict import Evidence as Evidence
    from .verdict import Freedom as Freedom
    from .verdict import Reason as Reason
    from .verify import verify as verify

__version__ = "0.1.0"

_HOMES = {
    "assemble": ("assemble",),
    "assembly.assembly": ("Assembly",),
    "assembly.pair_result": ("PairResult",),
    "clouds.cloud": ("PointCloud",),
    "clouds.files": ("read_cloud", "read_clouds", "write_cloud"),
    "clouds.thinning": ("thin",),
    "dof": ("Dof",),
    "errors": ("ArgumentError", "CloudFileError", "FieldError", "FieldalignError", "MissingExtraError", "RunError"),
    "evaluation.evaluate": ("Evaluation", "evaluate"),
    "inspection": ("Deviation", "deviation"),
    "odometry": ("Odometry", "OdometryResult", "OdometrySettings", "Tracking"),
    "odometry.localizer": ("Localization", "Localizer"),
    "odometry.loops": ("ClosedLoops", "close_loops"),
    "odometry.sequences": ("read_sequence",),
    "odometry.trajectory": ("Trajectory",),
    "odometry.trajectory_files": ("read_trajectory", "write_trajectory"),
    "prepare": ("prepare",),
    "prepared": ("PreparedCloud",),
    "register": ("register",),
    "register_many": ("register_many",),
    "result": ("RegistrationResult",),
    "settings": ("PRESETS", "Settings"),
    "verdict": ("Evidence", "Freedom", "Reason"),
    "verify": ("verify",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}
__all__ = sorted([*_HOME_OF, "fields"])


class _Package(ModuleType):
    """Importing a submodule sets it as an attribute: `register` and others stay the functions of that name."""

    def __setattr__(self, name: str, value: object) -> None:
        is_module_of_its_name = isinstance(value, ModuleType) and _HOME_OF.get(name) == name
        super().__setattr__(name, getattr(value, name) if is_module_of_its_name else value)


def __getattr__(name: str) -> Any:
    if name == "fields":
        return import_module(".fields", __name__)
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f".{_HOME_OF[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


sys.modules[__name__].__class__ = _Package
logging.getLogger(__name__).addHandler(logging.NullHandler())
