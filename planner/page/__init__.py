"""A run as one page that a phone shows without a network."""
