"""Reading of scenes from files and dictionaries: parsing, placing, validation and checks, with all faults at once."""
