"""A search for faults by random cases, each repeated by its seed alone: `python -m tests.fuzz`."""
