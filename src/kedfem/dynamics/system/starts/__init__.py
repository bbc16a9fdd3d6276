"""Where marches of a system begin: rates and accelerations that fit, deflections without vibration, divided steps."""
