"""Any Exudyn system as the skeleton: frames, joints, constraints, what is tracked of it."""
