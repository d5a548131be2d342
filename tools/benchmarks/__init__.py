"""Parts of `tools/benchmark.py`, and the longer programs that it starts."""
