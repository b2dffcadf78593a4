"""somatopy check-body: what a robot's model has, an anatomy for it, whether it sees its hand, and what is wrong."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import tyro

from somatopy.bodies import MODELS, Anatomy, BodyError, anatomy_path
from somatopy.bodies.survey import read_model, survey
from somatopy.cli.check_text import Examined, plain, say
from somatopy.cli.mirror import mark
from somatopy.cli.options import DEBUG, JSON, QUIET, SWITCH
from somatopy.cli.words import read
from somatopy.experiment.checkup import Checkup, Fault, checkup, model_faults
from somatopy.experiment.proposing import proposed

__all__ = ["main"]

TEXT = """Look at a robot before you run it: its joints, its cameras, its physics, and whether it sees its hand.

MODEL is an MJCF or URDF file, an anatomy file (TOML), or a robot that comes with somatopy (nao). For a model
without an anatomy one is proposed and tried; --propose prints it.

It exits with 0 if the robot can run, with 1 if it cannot, and says how to mend what is wrong.

example: somatopy check-body robot.xml --propose > my.toml
"""

_ANATOMY = "An anatomy file to try on this model, whatever model it names."
_PROPOSE = "Print an anatomy file for the model; all else goes to standard error."
_PICTURE = "Draw the robot, and what it sees, in two arm postures; without it nothing is drawn."


@dataclass(frozen=True)
class Options:
    """Options of this command."""

    model: Annotated[tyro.conf.Positional[str], mark("MODEL", "The robot.", None)]
    anatomy: Annotated[Path | None, mark("FILE", _ANATOMY, None)] = None
    propose: Annotated[SWITCH, mark(None, _PROPOSE, None)] = False
    picture: Annotated[Path | None, mark("FILE.png", _PICTURE, None)] = None
    json: JSON = False
    quiet: QUIET = False
    debug: DEBUG = False


def main(args: Sequence[str]) -> int:
    """Run `somatopy check-body MODEL [--anatomy FILE] [--propose] [--picture FILE.png] [--json]`."""
    options = read(Options, args, "somatopy check-body", TEXT)
    _refuse(options)
    examined = _examined(options)
    _say(examined, options)
    if options.propose and examined.text is not None:
        print(examined.text, end="")
    if options.picture is not None:
        _draw(examined, options.picture, options.quiet)
    if options.json:
        print(json.dumps(plain(examined)))
    return 0 if examined.result.runs else 1


def _say(examined: Examined, options: Options) -> None:
    """Print what was found: as the result, or beside it, where --quiet leaves it out if nothing is wrong."""
    beside = options.json or options.propose
    if not (beside and options.quiet and examined.result.runs):
        say(examined, sys.stderr if beside else sys.stdout)


def _refuse(options: Options) -> None:
    """Raise what is wrong use."""
    model = options.model
    if model not in MODELS and not os.path.isfile(model):
        raise BodyError(
            f"{model!r} is neither a file nor a robot that comes with somatopy ({', '.join(MODELS)}). Name an MJCF or "
            "URDF file, or an anatomy file: somatopy check-body robot.xml."
        )
    named = _is_anatomy(model)
    if named and (options.anatomy or options.propose):
        flag = "--anatomy" if options.anatomy else "--propose"
        raise BodyError(f"{model!r} has an anatomy already, so that {flag} means nothing here. Name its model instead.")
    if options.anatomy and options.propose:
        raise BodyError("--anatomy tries an anatomy that you have, --propose makes one. Choose one of them.")
    if options.json and options.propose:
        raise BodyError("--json and --propose both print to standard output. The JSON has the proposal: use --json.")
    if options.picture and options.picture.suffix.lower() != ".png":
        raise BodyError(f"The picture {str(options.picture)!r} must be a PNG: --picture robot.png.")


def _is_anatomy(model: str) -> bool:
    return model in MODELS or Path(model).suffix.lower() == ".toml"


def _examined(options: Options) -> Examined:
    """All that can be found; what cannot becomes a fault."""
    model, found, anatomy, text = Path(options.model), None, None, None
    try:
        anatomy = _given(options)
        model = anatomy.model if anatomy else model
        found = survey(read_model(model))
        if anatomy is None:
            made = proposed(model)
            anatomy, text = made.anatomy, made.text
        result = checkup(anatomy)
    except BodyError as error:
        result = Checkup((Fault(True, str(error)),))
    if found is not None:
        result = replace(result, faults=(*model_faults(found), *result.faults))
    return Examined(options.model, model, found, anatomy, text, result)


def _given(options: Options) -> Anatomy | None:
    """The anatomy that the user names, if any."""
    if options.anatomy is not None:
        return Anatomy.load(options.anatomy).model_copy(update={"model": Path(options.model)})
    return Anatomy.load(anatomy_path(options.model)) if _is_anatomy(options.model) else None


def _draw(examined: Examined, path: Path, quiet: bool) -> None:
    """Draw the picture, or say why not."""
    from somatopy.bodies import MujocoBody, NoGL
    from somatopy.cli.body_picture import body_picture, telling

    result = examined.result
    if examined.anatomy is None or result.outlook is None or result.arms is None:
        print("No picture is drawn: the robot could not be built.", file=sys.stderr)
        return
    try:
        with closing(MujocoBody(examined.anatomy, motion="kinematic")) as body:
            body_picture(body, telling(result.arms, result.outlook)).savefig(path, dpi=100)
        if not quiet:
            print(f"Picture: {path}", file=sys.stderr)
    except NoGL as error:
        print(f"No picture is drawn. {error}", file=sys.stderr)
