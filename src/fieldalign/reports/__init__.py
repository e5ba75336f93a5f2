"""Reports: pictures and pages of a result, for people."""

from .page_register import write_report

__all__ = ["write_report"]
