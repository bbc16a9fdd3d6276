"""Pages of docs/ that are made from the program's own records: keys of scenes, channels of results, capabilities."""
