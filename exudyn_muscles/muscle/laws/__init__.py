"""Muscle laws by their sources, and a law of the user's own."""
