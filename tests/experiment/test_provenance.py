"""What wrote a run: code of somebody's own is read as Python reads it."""

from __future__ import annotations

from pathlib import Path

import pytest

from somatopy.experiment.provenance import meaning

SOURCE = '"""A part."""\n\n\nclass Mine:\n    name = "Zoë"  # a comment\n'


@pytest.mark.parametrize(
    "content",
    [
        b"\xef\xbb\xbf" + SOURCE.encode(),
        SOURCE.replace("\n", "\r\n").encode(),
        ("# -*- coding: latin-1 -*-\n" + SOURCE).encode("latin-1"),
        SOURCE.replace("A part.", "Another word.").replace("  # a comment", "").encode(),
    ],
    ids=["byte order mark", "carriage returns", "latin-1", "other words"],
)
def test_the_same_code_means_the_same(content: bytes, tmp_path: Path) -> None:
    """However it is encoded, as long as Python can import it, and whatever its comments say."""
    (tmp_path / "plain.py").write_bytes(SOURCE.encode())
    (tmp_path / "other.py").write_bytes(content)
    assert meaning(tmp_path / "other.py") == meaning(tmp_path / "plain.py")
    assert meaning(tmp_path / "other.py") != meaning(Path(__file__))
