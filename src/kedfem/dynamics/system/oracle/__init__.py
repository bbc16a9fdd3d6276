"""The oracle: a system as one writes it down, which judges the compiled steps and shares none of their code."""
