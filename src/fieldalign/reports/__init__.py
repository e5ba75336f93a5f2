"""Reports: pictures and pages of a result, for people."""

from .page_assembly import write_assembly_report
from .page_batch import write_batch_report
from .page_experiment import write_experiment_report
from .page_odometry import write_odometry_report
from .page_register import write_report

__all__ = [
    "write_assembly_report", "write_batch_report", "write_experiment_report", "write_odometry_report", "write_report",
]
