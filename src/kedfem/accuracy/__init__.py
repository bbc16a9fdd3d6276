"""How far a result is from the truth, and the cheapest model that is near enough."""
