"""The report: one HTML page with everything in it, of one run, of several side by side, or of a study."""

from __future__ import annotations

from somatopy.analysis.report.page import Source, render_report, write_report
from somatopy.analysis.report.study import render_study, write_study

__all__ = ["Source", "render_report", "render_study", "write_report", "write_study"]
