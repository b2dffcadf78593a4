"""The command line: one verb a file, imported when it is called."""

from __future__ import annotations

import importlib
import os
import signal
import sys
import traceback
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version

from somatopy.cli.packages import installing

__all__ = ["main"]

VERBS = {
    "demo": "watch a robot learn to see its hand, in two minutes: a film and a report",
    "reproduce": "the paper from end to end: run, ceiling, controls, table, figures, report",
    "run": "run a preset or a description file",
    "resume": "continue a run after Ctrl-C or a kill, bit for bit",
    "report": "write the page of a run, with its figures, of several runs, or of a study",
    "film": "make a film of a run: the robot from outside, and what its eye sees",
    "evaluate": "ask the learner of a run where it would look at random arm postures",
    "compare": "compare learners and damages under many seeds, on all cores",
    "study": "run many experiments that a study file describes, here or on a Ray cluster",
    "check-body": "look at a robot of yours: its joints, its sight, what is wrong, an anatomy for it",
    "describe": "print the description file of a preset, with comments, to change and run",
    "list": "list presets, bodies, babbling ranges, learners, damages and all other kinds",
}

#: How MuJoCo begins to refuse a value of this variable, when it is imported.
_MUJOCO_GL = "invalid value for environment variable MUJOCO_GL"

USAGE = f"""usage: somatopy COMMAND [OPTIONS]

A robot babbles with its arm, watches its hand, and learns online where to look.

{chr(10).join(f"  {verb:<11}{text}" for verb, text in VERBS.items())}

example: somatopy run paper --minutes 10 --eye geometric
Each command explains itself: somatopy COMMAND --help
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        0 done, 1 failed, 2 wrong use, 130 after Ctrl-C, 143 after SIGTERM, 141 if the reader of standard output left.
        Tracebacks are shown with --debug only.
    """
    args = [*(sys.argv[1:] if argv is None else argv)]  # `list` is a verb's module here, once it is imported
    try:
        code = _answer(args)
        sys.stdout.flush()
    except BrokenPipeError:  # who read standard output, such as head, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return 141
    return code


def _answer(args: list[str]) -> int:
    if not args or args[0] in ("-h", "--help"):
        print(USAGE, end="")
        return 0 if args else 2
    if args[0] == "--version":
        print(_version())
        return 0
    verb, *rest = args
    if verb not in VERBS:
        from somatopy.validation import meant

        asked = meant(verb, VERBS)
        return _fail(f"{verb!r} is no command of somatopy. {asked}Choose one of {', '.join(VERBS)}.", 2)
    os.environ.setdefault("PYDANTIC_ERRORS_INCLUDE_URL", "0")
    return _called(verb, rest)


def _called(verb: str, rest: Sequence[str]) -> int:
    try:
        code: int = importlib.import_module(f"somatopy.cli.{verb.replace('-', '_')}").main(rest)
    except KeyboardInterrupt as interrupt:
        return _fail(str(interrupt) or "Interrupted.", 128 + getattr(interrupt, "signal", signal.SIGINT))
    except SystemExit as error:
        return error.code if isinstance(error.code, int) else 2
    except BrokenPipeError:
        raise
    except Exception as error:
        if "--debug" in rest:
            traceback.print_exc()
        return _fail(*_told(error))
    return code


def _told(error: Exception) -> tuple[str, int]:
    """What to say of an error, and the exit code."""
    if isinstance(error, ModuleNotFoundError) and (install := installing(error)):
        return install, 2
    if str(error).startswith(_MUJOCO_GL):  # nothing that imports MuJoCo can be imported then
        return f"{str(error)[:1].upper()}{str(error)[1:]}. Choose egl or osmesa, or none: unset MUJOCO_GL.", 2
    notes = getattr(error, "__notes__", [])
    if _is_wrong_use(error):
        return " ".join([str(error), *notes]), 2
    said = f"{': '.join(filter(None, (type(error).__name__, str(error))))} (where: --debug)"
    return f"{said}. {' '.join(notes)}" if notes else said, 1


def _version() -> str:
    try:
        return version("somatopy")
    except PackageNotFoundError:
        return "somatopy is not installed; these are its sources"


def _is_wrong_use(error: Exception) -> bool:
    """Whether the user can mend it: a description, a robot, a run folder or a machine that does not fit."""
    from somatopy.analysis.runs import RunFolderError
    from somatopy.analysis.video import NoEncoder
    from somatopy.bodies import BodyError, NoGL
    from somatopy.experiment import DescriptionError
    from somatopy.posix import NotPosix

    return isinstance(error, DescriptionError | BodyError | NoGL | NoEncoder | NotPosix | RunFolderError)


def _fail(message: str, code: int) -> int:
    print(f"somatopy: {message}", file=sys.stderr)
    return code
