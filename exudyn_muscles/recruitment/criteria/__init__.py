"""What is preferred among the forces that deliver a torque, one kind a file."""
