"""From files and dictionaries to a scene: parsed, placed, validated, checked, all faults raised at once."""
