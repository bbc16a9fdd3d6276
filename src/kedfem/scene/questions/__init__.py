"""Questions about a scene: frames, timing, laws of motion, planes, joints enforced by equations."""
