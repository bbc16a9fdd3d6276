"""Parts from CAD: reading files, choosing a solid, describing its faces."""
