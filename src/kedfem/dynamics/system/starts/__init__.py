"""Where marches of a system begin: rates and accelerations that fit, deflections without vibration, divided steps.

States: `initial_states` (rest, given links), `deflected` (static, quasi-static, plucked), `impacts` (divided steps). They
ask an `instant` of the motion for `internal_forces` and `coordinate_rates`; `modified_newton`, and `newton_krylov` where
it diverges, find deflections, `accelerations` what fits them, all by `linear_equations` of `turning_bodies` and others.
"""
