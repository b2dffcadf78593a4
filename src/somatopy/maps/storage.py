"""Maps in files: parameters as JSON, what was learned as arrays, nothing pickled."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from inspect import isabstract
from pathlib import Path
from typing import Any

import numpy as np
from sklearn.base import clone

from somatopy.maps.base import Map

__all__ = ["load_map", "save_map"]

FORMAT = 1
PARAMETER = "parameter:"  # leads the names of parameters that are arrays
LEARNED = "learned:"  # and those of what was learned
GENERATORS = ("PCG64", "PCG64DXSM", "MT19937", "Philox", "SFC64")


def save_map(trained: Map, path: str | os.PathLike[str]) -> None:
    """Write a map to one .npz file, complete or not at all; see `Map.save`."""
    parameters = trained.get_params(deep=False)
    arrays = {PARAMETER + name: value for name, value in parameters.items() if isinstance(value, np.ndarray)}
    kind = type(trained)
    header = {
        "format": FORMAT,
        "map": kind.__qualname__,
        "module": kind.__module__,
        "parameters": {
            name: _as_json(name, value) for name, value in parameters.items() if PARAMETER + name not in arrays
        },
        "feature_names": list(getattr(trained, "feature_names_in_", [])),
    }
    if trained.__sklearn_is_fitted__():
        arrays |= {LEARNED + name: value for name, value in _restorable(trained).items()}
    if pickled := [name for name, value in arrays.items() if value.dtype.hasobject]:
        raise ValueError(f"{pickled} hold Python objects, which cannot be saved; give arrays of numbers")
    _write(Path(path), {"header": np.array(json.dumps(header)), **arrays})


def _restorable(trained: Map) -> dict[str, Any]:
    """The state of a map, once a map of its parameters has been found to take it."""
    for name, fixed in trained._fixed.items():
        if not np.array_equal(getattr(trained, name), fixed):
            raise ValueError(
                f"{name} is {getattr(trained, name)!r} now, but the map has started with {fixed!r}: set it back, or "
                "initialise the map anew"
            )
    state = trained.state()
    clone(trained).restore(state)
    return state


def _write(target: Path, arrays: dict[str, Any]) -> None:
    aside = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        with aside.open("wb") as file:
            np.savez(file, **arrays)
        aside.replace(target)
    finally:
        aside.unlink(missing_ok=True)


def load_map(path: str | os.PathLike[str]) -> Map:
    """Read a map that `Map.save` wrote; learning goes on bit for bit.

    A map of your own is found once its class has been defined or imported.

    Raises:
        OSError: if the file cannot be opened.
        ValueError: if the file is not a map, is damaged, or its class is not known.

    Example:
        >>> import tempfile
        >>> from somatopy.maps import SOM
        >>> som = SOM(shape=(3, 3), random_state=0).partial_fit([[0.1, 0.2], [0.8, 0.4]])
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     som.save(f"{folder}/som.npz")
        ...     load_map(f"{folder}/som.npz").samples_seen_
        2
    """
    arrays = _read(Path(path))
    try:
        header = json.loads(str(arrays["header"]))
        version, name, module = header["format"], str(header["map"]), header["module"]
        parameters = {key: _from_json(value) for key, value in header["parameters"].items()}
        feature_names = [str(key) for key in header["feature_names"]]
    except Exception as error:  # whatever a header that is not ours leads to
        raise ValueError(f"{path} is not a map, or is damaged: {type(error).__name__}: {error}") from error
    if version != FORMAT:
        raise ValueError(f"{path} has format {version!r}; this version reads format {FORMAT}")
    kind = _kind(name, module, path)
    try:
        loaded = kind(**parameters, **_named(arrays, PARAMETER))
    except TypeError as error:
        raise ValueError(f"{path} has parameters that {name} does not know: {error}") from error
    if state := _named(arrays, LEARNED):
        loaded.restore(state)
    if feature_names:
        loaded.feature_names_in_ = np.array(feature_names, dtype=object)
    return loaded


def _read(path: Path) -> dict[str, Any]:
    """All arrays of a file."""
    with path.open("rb") as file:
        try:
            with np.load(file, allow_pickle=False) as members:
                return {name: members[name] for name in members.files}
        except Exception as error:  # a damaged archive raises errors of a dozen kinds
            raise ValueError(f"{path} is not a map, or is damaged: {type(error).__name__}: {error}") from error


def _named(arrays: dict[str, Any], kind: str) -> dict[str, Any]:
    return {name.removeprefix(kind): value for name, value in arrays.items() if name.startswith(kind)}


def _kind(name: str, module: str, path: str | os.PathLike[str]) -> type[Map]:
    """The class of that name; where several modules have one, that of the module."""
    kinds = [kind for kind in _kinds(Map) if kind.__qualname__ == name]
    chosen = [kind for kind in kinds if kind.__module__ == module] or kinds
    if not chosen:
        known = sorted({kind.__qualname__ for kind in _kinds(Map) if not isabstract(kind)})
        raise ValueError(f"{path} holds a {name}, which is not a known map; import its class first. Known: {known}")
    if len({kind.__module__ for kind in chosen}) > 1:
        modules = sorted(kind.__module__ for kind in chosen)
        raise ValueError(f"{path} holds a {name} of {module}; import that module. Others of this name: {modules}")
    return chosen[-1]  # the last one where a class has been defined anew, as notebooks do


def _kinds(kind: Any) -> Iterator[type[Map]]:
    for child in kind.__subclasses__():
        yield child
        yield from _kinds(child)


def _as_json(name: str, value: Any) -> Any:
    """A parameter as JSON has it: tuples and generators are marked, to come back as such."""
    if isinstance(value, np.random.Generator) and type(value.bit_generator).__name__ in GENERATORS:
        return {"generator": _listed(value.bit_generator.state)}
    if isinstance(value, (tuple, list)):
        items = [_as_json(name, item) for item in value]
        return {"tuple": items} if isinstance(value, tuple) else items
    if isinstance(value, (type, np.dtype)) and not np.dtype(value).hasobject:
        return np.dtype(value).name
    plain = value.item() if isinstance(value, np.generic) else value
    if plain is None or isinstance(plain, (bool, int, float, str)):
        return plain
    raise ValueError(
        f"the parameter {name} is a {type(value).__name__}, which cannot be saved; give plain numbers or text"
    )


def _listed(state: Any) -> Any:
    """The state of a generator with lists for arrays."""
    if isinstance(state, dict):
        return {key: _listed(value) for key, value in state.items()}
    return state.tolist() if isinstance(state, np.ndarray) else state


def _from_json(value: Any) -> Any:
    if isinstance(value, dict) and "tuple" in value:
        return tuple(_from_json(item) for item in value["tuple"])
    if isinstance(value, dict):
        kind = value["generator"]["bit_generator"]
        if kind not in GENERATORS:
            raise ValueError(f"unknown generator {kind!r}; known: {list(GENERATORS)}")
        bits = getattr(np.random, kind)()
        bits.state = value["generator"]
        return np.random.Generator(bits)
    if isinstance(value, list):
        return [_from_json(item) for item in value]
    return value
