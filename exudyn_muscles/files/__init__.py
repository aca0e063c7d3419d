"""Files on disk, and tables over time."""
