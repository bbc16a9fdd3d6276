"""Records of a scene: its tables with their keys, each checked independently of the others."""
