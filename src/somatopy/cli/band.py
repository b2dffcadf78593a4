"""The band of `reproduce`: the same experiment under more seeds, with the geometric eye, beside the main run."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

import tomli_w

from somatopy.analysis.runs import BAND
from somatopy.cli.run import note
from somatopy.experiment import Description
from somatopy.files import write_whole
from somatopy.studies.folder import plain
from somatopy.studies.local import cores
from somatopy.studies.worker import end_with

__all__ = ["Band"]

PLAN = f"{BAND}.toml"
#: How long a band that is to stop may take, s; a cell under way then writes its checkpoint.
PATIENCE_S = 60.0


class Band:
    """A study in a process of its own, for as long as the context lasts; what it has finished stays.

    The study folder is `band` in the run folder, its plan `band.toml` beside it: `somatopy study` could go on with it.

    Args:
        folder: the run folder; a band that it holds already goes on.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._process: subprocess.Popen[bytes] | None = None

    @classmethod
    def planned(cls, folder: Path, description: Description, seeds: int) -> Self:
        """The band of a description: seeds from its own up, which comes last; with one seed there is none."""
        own, band = description.seed, cls(folder)
        if seeds > 1:
            every = plain(description.model_dump(mode="json", exclude={"name", "seed", "eye"}))
            table: dict[str, Any] = {
                "name": BAND,
                "seeds": [*range(own + 1, own + seeds), own],
                "ceilings": False,
                "every": every,
                "conditions": [{"name": description.name}],
            }
            write_whole(folder / PLAN, tomli_w.dumps(table))
        return band

    def __enter__(self) -> Self:
        if (self._folder / PLAN).exists():
            command = [sys.executable, "-m", "somatopy.cli.band", str(os.getpid()), str(self._folder / PLAN)]
            command += ["--out", str(self._folder / BAND), "--processes", str(cores())]
            with self._log.open("wb") as log:  # Ctrl-C reaches this process alone, which then tells the band once
                self._process = subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, process_group=0
                )
        return self

    @property
    def _log(self) -> Path:
        return self._folder / f"{BAND}.log"

    def wait(self, quiet: bool = False) -> bool:
        """Wait until the band has ended; it is said that this is waited for, unless quiet.

        Returns:
            Whether it ended well; if not, it is said where to read why.
        """
        if self._process is None:
            return True
        if self._process.poll() is None and not quiet:
            note("The run has ended; waiting for the band of seeds.")
        if self._process.wait():
            note(f"The band of seeds failed: {self._log} says why. Try again: somatopy resume {self._folder}")
            return False
        self._log.unlink()
        return True

    def __exit__(self, *_: object) -> None:
        if self._process is not None and self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
            try:
                self._process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()

    def discard(self) -> None:
        """Remove what was planned."""
        for _ in range(50):  # processes of the band end a moment after it, and may write until then
            shutil.rmtree(self._folder / BAND, ignore_errors=True)
            if not (self._folder / BAND).exists():
                break
            time.sleep(0.1)
        for path in (self._folder / PLAN, self._log):
            path.unlink(missing_ok=True)


def main(args: Sequence[str]) -> int:
    """What the process of a band runs: `somatopy study`, which ends at once when the run beside it is killed."""
    from somatopy import cli

    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
    parent, *rest = args
    end_with(int(parent))
    return cli.main(["study", *rest])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
