"""What the controller does: the force that a policy demands, sensors and supply, and prediction."""
