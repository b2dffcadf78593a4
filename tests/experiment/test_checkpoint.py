"""Checkpoints come back as they were or not at all, one whole one is always there, and one process has the folder."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from somatopy.experiment import DescriptionError
from somatopy.experiment.checkpoint import read_checkpoint, write_checkpoint

FILE = "checkpoint.npz"
DTYPES = ("float64", "float32", "int64", "int32", "uint8", "bool", "complex128", "U5")
KEYS = st.text("abcxyz_019 äπ/.", min_size=1, max_size=6) | st.sampled_from(["file", "plain", "allow_pickle", "state"])
PLAIN = st.none() | st.booleans() | st.integers(-(2**130), 2**130) | st.floats() | st.text(max_size=9)
VALUES = (
    PLAIN
    | st.lists(PLAIN, max_size=3)
    | st.sampled_from(DTYPES).flatmap(lambda dtype: arrays(dtype, array_shapes(min_dims=0, max_dims=3, min_side=0)))
)
STATES = st.dictionaries(KEYS, st.recursive(VALUES, lambda inner: st.dictionaries(KEYS, inner, max_size=3)), max_size=5)


def same(a: Any, b: Any) -> bool:
    """Equal types, shapes and bits; NaN is NaN."""
    if isinstance(a, np.ndarray):
        whole = isinstance(b, np.ndarray) and a.dtype == b.dtype and a.shape == b.shape
        return bool(whole and a.tobytes() == b.tobytes())
    if isinstance(a, dict):
        return isinstance(b, dict) and a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list):
        return isinstance(b, list) and len(a) == len(b) and all(map(same, a, b))
    return type(a) is type(b) and (a == b or (a != a and b != b))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / FILE


STATE: dict[str, Any] = {"a": {"b": np.arange(5.0), "n": 3}, "e": np.empty((0, 2))}


@given(STATES)
def test_what_is_written_comes_back(state: dict[str, Any]) -> None:
    """Nested arrays of any type and shape, empty ones, NaN and infinities, integers beyond 64 bits, text, lists."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / FILE
        write_checkpoint(path, state)
        assert same(read_checkpoint(path), state)


@pytest.mark.parametrize("kind", [np.random.PCG64, np.random.MT19937, np.random.Philox, np.random.SFC64])
def test_a_generator_goes_on_where_it_stood(path: Path, kind: type[np.random.BitGenerator]) -> None:
    """States of 128-bit integers, of arrays, and of both: the same numbers follow."""
    rng = np.random.Generator(kind(7))
    rng.random(1001)
    rng.integers(0, 5, dtype=np.int32)
    write_checkpoint(path, {"rng": rng.bit_generator.state})
    other = np.random.Generator(kind(8))
    other.bit_generator.state = read_checkpoint(path)["rng"]
    assert same(rng.random(1000), other.random(1000)) and same(rng.integers(0, 99, 99), other.integers(0, 99, 99))


def test_single_numbers_of_numpy_become_plain_ones(path: Path) -> None:
    """Their values stay, whatever their type."""
    write_checkpoint(path, {"n": np.int64(2**62 + 1), "x": np.float64(0.1), "yes": np.bool_(True)})
    assert read_checkpoint(path) == {"n": 2**62 + 1, "x": 0.1, "yes": True}


def test_there_is_no_pickle_in_it(path: Path) -> None:
    """Every member is an array that NumPy reads with pickle forbidden; what would need it is refused."""
    write_checkpoint(path, STATE)
    with np.load(path, allow_pickle=False) as file:
        assert len(file.files) == 3
        assert all(file[name].dtype.kind in "fU" for name in file.files)
    with pytest.raises(TypeError, match="because of a: it is an array of objects"):
        write_checkpoint(path, {"a": np.array([object()])})


def test_it_is_replaced_as_a_whole(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A write that fails, at the first byte, in the middle or before the last step, leaves the old checkpoint."""
    write_checkpoint(path, STATE)

    def fail(*args: object) -> None:
        raise OSError("disk full")

    def half(file: Any, **arrays: Any) -> None:
        file.write(b"PK\x03\x04 the beginning of something")
        fail()

    with pytest.raises(TypeError):
        write_checkpoint(path, {"a": object()})
    for module, name, broken in ((np, "savez", half), (os, "replace", fail)):
        with monkeypatch.context() as patch:
            patch.setattr(module, name, broken)
            with pytest.raises(OSError, match="disk full"):
                write_checkpoint(path, {"a": 2})
        assert same(read_checkpoint(path), STATE)
    write_checkpoint(path, {"a": 2})
    assert read_checkpoint(path) == {"a": 2}
    assert [entry.name for entry in path.parent.iterdir()] == [FILE]


def test_a_broken_one_is_named(path: Path) -> None:
    """Cut off anywhere, or with any byte changed: an error that names the file, or the state as it was."""
    write_checkpoint(path, STATE)
    whole = path.read_bytes()
    cut = [whole[:n] for n in range(0, len(whole), 7)]
    changed = [whole[:n] + bytes([whole[n] ^ 255]) + whole[n + 1 :] for n in range(len(whole))]
    header = whole.replace(b"'fortran_order': ", b"'fortran_order'( ")  # NumPy's reader of headers stumbles over it
    refused = 0
    for broken in (*cut, *changed, header):
        path.write_bytes(broken)
        try:
            assert same(read_checkpoint(path), STATE)
        except DescriptionError as error:
            refused += 1
            assert str(error).startswith(f"{path} is no checkpoint that can be read: ")
    assert refused > 0.5 * len(whole)


def test_the_end_of_a_phase_is_offered_in_the_place_of_a_broken_one(path: Path) -> None:
    """The last there is; it is a checkpoint as well as the other. Nobody is told to unpickle anything."""
    path.write_bytes(b"half of something")
    with pytest.raises(DescriptionError, match=r"no file of NumPy's\. Restore it from a copy, or run the"):
        read_checkpoint(path)
    for number in (2, 10):
        write_checkpoint(path.with_name(f"phase-{number}.npz"), {"a": number})
    with pytest.raises(DescriptionError, match=r"copy phase-10\.npz over it: the run then goes on"):
        read_checkpoint(path)


def test_what_is_no_checkpoint_is_named(path: Path) -> None:
    """Nothing there, a folder, text, one array, a file of other arrays."""
    others = {
        "none": lambda p: None,
        "folder": Path.mkdir,
        "text": lambda p: p.write_text("state"),
        "array": lambda p: np.save(p.open("wb"), np.arange(3)),
        "arrays": lambda p: np.savez(p.open("wb"), codebook=np.arange(3)),
        "words": lambda p: np.savez(p.open("wb"), plain=np.array("words")),
        "number": lambda p: np.savez(p.open("wb"), plain=np.array("3")),
    }
    for name, make in others.items():
        other = path.with_name(name)
        make(other)
        with pytest.raises(DescriptionError, match=f"{other} is no checkpoint that can be read"):
            read_checkpoint(other)
