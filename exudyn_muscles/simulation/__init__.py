"""Muscles in a run of Exudyn: the plugin on its user functions, and one run's life."""
