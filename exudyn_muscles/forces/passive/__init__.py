"""Forces that the pose and its rate decide: springs, ligaments, limits, bushings, contact."""
