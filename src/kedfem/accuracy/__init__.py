"""Error estimates of results, and the choice of the cheapest model that is accurate enough."""
