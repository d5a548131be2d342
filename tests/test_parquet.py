"""Tables that nobody can read are refused in one line."""

from pathlib import Path

import pyarrow
import pyarrow.parquet
import pytest

from planner.errors import InputError
from planner.parquet import read_table


def test_a_column_whose_name_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "t.parquet"
    pyarrow.parquet.write_table(pyarrow.table({"distance": [1.0]}), path, store_schema=False)
    path.write_bytes(path.read_bytes().replace(b"distance", b"dis\xffance"))
    with pytest.raises(InputError, match=r"t\.parquet: is no readable Parquet file"):
        read_table(path)
