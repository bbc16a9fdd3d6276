"""What can be asked of a scene: frames, timing, laws of motion, planes, joints that move."""
