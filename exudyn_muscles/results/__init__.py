"""What a method found: trajectories, recorded, stored and compared."""
