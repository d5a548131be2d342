"""Columns kept in files come back as they were, or not at all."""

from pathlib import Path

import numpy as np
import pytest

from planner.npz import read_columns, write_columns


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    path = tmp_path / "kept.npz"
    write_columns(path, {"x": np.arange(3, dtype=np.int32), "text": np.array("ü")})
    return path


def test_what_was_written_is_read(kept: Path) -> None:
    found = read_columns(kept, ("x", "text"))
    assert found is not None
    assert found["x"].dtype == np.int32
    assert found["x"].tolist() == [0, 1, 2]
    assert str(found["text"]) == "ü"


def test_a_column_that_is_missing_leaves_none(kept: Path) -> None:
    assert read_columns(kept, ("x", "y")) is None


def test_no_file_is_none(tmp_path: Path) -> None:
    assert read_columns(tmp_path / "none.npz", ("x",)) is None


@pytest.mark.parametrize("damage", ["cut", "flipped", "emptied", "pickled"])
def test_a_damaged_file_is_none(kept: Path, damage: str) -> None:
    content = kept.read_bytes()
    middle = content.index(b"NUMPY") + 100
    damaged = {
        "cut": content[: len(content) // 2],
        "flipped": content[:middle] + bytes([content[middle] ^ 0xFF]) + content[middle + 1 :],
        "emptied": b"",
    }
    if damage == "pickled":
        np.savez(kept, x=np.array([{}], dtype=object))
    else:
        kept.write_bytes(damaged[damage])
    assert read_columns(kept, ("x",)) is None
