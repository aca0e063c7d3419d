"""The Exudyn side: a system's state, its mass matrix and forces, its coordinates."""
