"""The report: one HTML page with everything in it, of one run or of several side by side."""

from __future__ import annotations

from somatopy.analysis.report.page import Source, render_report, write_report

__all__ = ["Source", "render_report", "write_report"]
