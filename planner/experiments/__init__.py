"""Experiments: conditions as data, batch runs that go on where they were stopped."""
