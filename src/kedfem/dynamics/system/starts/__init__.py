"""Initial states of a system: consistent rates and accelerations, deflections without vibration, divided steps.

`initial_states` makes states without deflection, `deflected` static, quasi-static and plucked ones, `relieved` those of
what nothing drives, `impacts` those within divided steps. An `instant` of the motion gives `internal_forces` and
`coordinate_rates`; `modified_newton`, and `newton_krylov` where it diverges, find deflections, in the static modes of
large bodies (`condensed`), and `accelerations` the accelerations that fit, all by `linear_equations`.
"""
