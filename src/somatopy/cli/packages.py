"""Which command installs a package that is missing."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, requires

__all__ = ["installing"]

#: Packages whose modules have other names.
_PACKAGES = {"cv2": "opencv-python-headless", "sklearn": "scikit-learn", "PIL": "pillow"}
_REQUIREMENT = re.compile(r"([A-Za-z0-9._-]+)(?:.*extra == ['\"]([^'\"]+))?")


def installing(error: ModuleNotFoundError, requirements: Sequence[str] | None = None) -> str:
    """What to say of a module that is missing, with the command that installs it.

    Args:
        error: what the import raised.
        requirements: of somatopy, as its metadata list them; looked up if None.

    Returns:
        One sentence; nothing if no requirement of somatopy brings that module.

    Example:
        >>> error = ModuleNotFoundError("No module named 'ray'", name="ray.util")
        >>> installing(error, ["numpy>=2.0", 'ray>=2.40; extra == "cluster"'])
        'This needs the package ray, which is not installed: pip install "somatopy[cluster]".'
    """
    module = (error.name or "").partition(".")[0]
    package = _PACKAGES.get(module, module.replace("_", "-"))
    listed = _required() if requirements is None else requirements
    found = [match.groups() for text in listed if (match := _REQUIREMENT.match(text)) and match[1] == package]
    if not package or not found:
        return ""
    extras = [extra for _, extra in found]
    wanted = "somatopy" if None in extras else f"somatopy[{extras[0]}]"
    return f'This needs the package {package}, which is not installed: pip install "{wanted}".'


def _required() -> Sequence[str]:
    try:
        return requires("somatopy") or ()
    except PackageNotFoundError:
        return ()
