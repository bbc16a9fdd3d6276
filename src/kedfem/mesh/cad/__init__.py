"""Parts from CAD: files, the one solid in them, what its faces are."""
