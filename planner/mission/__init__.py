"""A plan meets the truth."""
