"""Maps in files: parameters as JSON, what was learned as arrays, nothing pickled."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from somatopy.maps.base import Map

__all__ = ["load_map", "save_map"]

FORMAT = 1
PARAMETER = "parameter:"  # leads the names of parameters that are arrays; what was learned has no such names


def save_map(trained: Map, path: str | os.PathLike[str]) -> None:
    """Write a map to one .npz file, complete or not at all; see `Map.save`."""
    plain: dict[str, Any] = {}
    arrays: dict[str, Any] = {}
    for name, value in trained.get_params(deep=False).items():
        if isinstance(value, np.ndarray):
            arrays[PARAMETER + name] = value
        else:
            plain[name] = _as_json(name, value)
    header = {"format": FORMAT, "map": type(trained).__name__, "parameters": plain}
    target = Path(path)
    aside = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        with aside.open("wb") as file:
            np.savez(file, header=np.array(json.dumps(header)), **arrays, **dict[str, Any](trained.state()))
        aside.replace(target)
    finally:
        aside.unlink(missing_ok=True)


def load_map(path: str | os.PathLike[str]) -> Map:
    """Read a map that `Map.save` wrote; learning goes on bit for bit.

    A map of your own is found once its class has been defined or imported.

    Raises:
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
    try:
        with np.load(Path(path), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        header = json.loads(str(arrays.pop("header")))
        name, parameters = header["map"], dict(header["parameters"])
    except FileNotFoundError:
        raise
    except (OSError, EOFError, ValueError, KeyError, TypeError, BadZipFile) as error:
        raise ValueError(f"{path} is not a map, or is damaged: {error}") from error
    if header.get("format") != FORMAT:
        raise ValueError(f"{path} has format {header.get('format')!r}; this version reads format {FORMAT}")
    kinds = {kind.__name__: kind for kind in _kinds(Map)}
    if name not in kinds:
        raise ValueError(
            f"{path} holds a {name}, which is not a known map; import its class first. Known: {sorted(kinds)}"
        )
    parameters = {key: _from_json(value) for key, value in parameters.items()}
    for key in [key for key in arrays if key.startswith(PARAMETER)]:
        parameters[key.removeprefix(PARAMETER)] = arrays.pop(key)
    try:
        loaded: Map = kinds[name](**parameters)
    except TypeError as error:
        raise ValueError(f"{path} has parameters that {name} does not know: {error}") from error
    if arrays.keys() - {"n_features_in_"}:
        loaded.restore(arrays)
    return loaded


def _kinds(kind: Any) -> Iterator[type[Map]]:
    for child in kind.__subclasses__():
        yield child
        yield from _kinds(child)


def _as_json(name: str, value: Any) -> Any:
    """A parameter as JSON has it: tuples and generators are marked, to come back as such."""
    if isinstance(value, np.random.Generator):
        return {"generator": value.bit_generator.state}
    if isinstance(value, tuple):
        return {"tuple": [_as_json(name, item) for item in value]}
    if isinstance(value, (type, np.dtype)):
        return np.dtype(value).name
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, list):
        return [_as_json(name, item) for item in value]
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    raise ValueError(
        f"the parameter {name} is a {type(value).__name__}, which cannot be saved; give plain numbers or text"
    )


def _from_json(value: Any) -> Any:
    if isinstance(value, dict) and "tuple" in value:
        return tuple(_from_json(item) for item in value["tuple"])
    if isinstance(value, dict) and "generator" in value:
        bits = getattr(np.random, value["generator"]["bit_generator"])()
        bits.state = value["generator"]
        return np.random.Generator(bits)
    if isinstance(value, list):
        return [_from_json(item) for item in value]
    return value
