"""The records of a scene: its tables and keys, each checked on its own."""
