"""Reports: pictures and pages of a result, for people."""

from .page_batch import write_batch_report
from .page_register import write_report

__all__ = ["write_batch_report", "write_report"]
