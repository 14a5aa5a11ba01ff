"""Report: one HTML page that answers, proves and can be reproduced."""

from discovery.report.compare import write_comparison
from discovery.report.figures import write_figures
from discovery.report.page import write_report

__all__ = ["write_comparison", "write_figures", "write_report"]
