"""Tables that nobody can read are refused in one line."""

import subprocess
import sys
from pathlib import Path

import pyarrow
import pyarrow.parquet
import pytest

from planner.errors import InputError
from planner.parquet import read_table, write_table


def test_a_column_whose_name_is_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "t.parquet"
    pyarrow.parquet.write_table(pyarrow.table({"distance": [1.0]}), path, store_schema=False)
    path.write_bytes(path.read_bytes().replace(b"distance", b"dis\xffance"))
    with pytest.raises(InputError, match=r"t\.parquet: is no readable Parquet file"):
        read_table(path)


def test_texts_are_written_without_pandas(tmp_path: Path) -> None:
    path, words = tmp_path / "t.parquet", ["Zürich", "", "a\nb", "\N{LINEAR B SYLLABLE B008 A}"]
    write_table(path, {"word": words}, {})
    assert read_table(path).to_pydict() == {"word": words}
    write = "from pathlib import Path; from planner.parquet import dictionary, write_table as w; "
    write += "import numpy as np, sys; codes = dictionary(np.zeros(1, int), ['x'], missing=-1); "
    write += f"w(Path({str(path)!r}), {{'a': ['x'], 'b': codes}}, {{}}); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", write], check=True, capture_output=True, text=True)
    assert "pandas" not in done.stdout.split()
