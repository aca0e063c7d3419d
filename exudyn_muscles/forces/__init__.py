"""What acts on a skeleton beside the muscles: ideal actuators."""
