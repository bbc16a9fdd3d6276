"""The motion that repeats itself with the period: the map of a period, the state that it leaves as it is, multipliers."""
