"""A process that runs cells for a study: one task a line on standard input, one answer a line on standard output.

`somatopy.studies.local` starts it. It ends when its input ends, and immediately when the process that started it is
gone, so that it cannot go on writing to a folder in which a new study runs.
"""

from __future__ import annotations

import faulthandler
import gc
import json
import os
import sys
import threading
import time
import traceback
from pathlib import Path
from typing import IO, Any

__all__ = ["end_with", "main"]

_PARENT_S = 0.5


def main() -> None:
    """Serve until the input ends."""
    faulthandler.enable()
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what own parts print is no answer
    end_with(os.getppid())
    first = json.loads(sys.stdin.readline())
    sys.path[:] = first["path"]
    _serve(answers, Path(first["scratch"]))


def end_with(parent: int) -> None:
    """From now on, end this process at once when the one that started it, whose id this is, is gone."""
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_PARENT_S)
    os._exit(1)


def _serve(answers: IO[str], scratch: Path) -> None:
    from somatopy.api import Interrupted
    from somatopy.studies.work import Task, work

    for line in sys.stdin:
        answer: dict[str, Any]
        try:
            task = Task(*json.loads(line))._replace(keep=True)  # until the driver has written its rows
            answer = {"rows": work(task, scratch)}
        except (Interrupted, KeyboardInterrupt):
            return
        except BaseException as error:
            traceback.print_exc()
            notes = [note for note in getattr(error, "__notes__", []) if "somatopy resume" not in note]
            answer = {"cause": ". ".join([f"{type(error).__name__}: {error}".rstrip("."), *notes])}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()
        gc.collect()  # parts of an experiment refer to each other: only this frees what the last cell held


if __name__ == "__main__":
    main()
