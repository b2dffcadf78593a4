"""Analysis: reads run folders, never a live experiment.

`load_run` opens a folder, `summarise` computes the measures of its summary.json. Windows, trends, table and figures
have a module each; scipy, pyarrow and matplotlib are imported only when they are needed.
"""

from __future__ import annotations

from somatopy.analysis.runs import load_run
from somatopy.analysis.summary import summarise

__all__ = ["load_run", "summarise"]
