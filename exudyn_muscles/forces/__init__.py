"""What acts at points of links and on coordinates, and J^T: generalized forces of it."""
