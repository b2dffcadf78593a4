"""The band of `reproduce`: the same experiment under more seeds, with the geometric eye, beside the main run."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any, Self

import tomli_w

from somatopy.analysis.runs import BAND
from somatopy.cli.run import note
from somatopy.experiment import Description, DescriptionError
from somatopy.studies.folder import plain
from somatopy.studies.local import cores

__all__ = ["Band"]

PLAN = f"{BAND}.toml"


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
            (folder / PLAN).write_text(tomli_w.dumps(table), encoding="utf-8")
        return band

    def __enter__(self) -> Self:
        if (self._folder / PLAN).exists():
            command = [sys.executable, "-m", "somatopy", "study", str(self._folder / PLAN)]
            command += ["--out", str(self._folder / BAND), "--processes", str(max(1, cores() - 1))]
            log = (self._folder / f"{BAND}.log").open("wb")
            self._process = subprocess.Popen(command, stdout=log, stderr=log)
        return self

    def wait(self) -> None:
        """Wait until the band has ended.

        Raises:
            DescriptionError: it failed; the message says where to read why.
        """
        if self._process is None:
            return
        if self._process.poll() is None:
            note("The run has ended; waiting for the band of seeds.")
        if self._process.wait():
            raise DescriptionError(
                f"The band of seeds failed: {self._folder / BAND}.log says why. Go on with somatopy resume."
            )
        (self._folder / f"{BAND}.log").unlink()

    def __exit__(self, *_: object) -> None:
        if self._process is not None and self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
            self._process.wait()

    def discard(self) -> None:
        """Remove what was planned."""
        shutil.rmtree(self._folder / BAND, ignore_errors=True)
        for name in (PLAN, f"{BAND}.log"):
            (self._folder / name).unlink(missing_ok=True)
