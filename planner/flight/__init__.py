"""The drone's side: what it can fly, and where it is when."""
