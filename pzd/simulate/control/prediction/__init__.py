"""How a ride goes on, for a policy that tries voltages before it sets one: plant, road ahead, choice."""
