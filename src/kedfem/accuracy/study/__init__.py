"""Speed against error of a scene in many variants: `kedfem accuracy`."""
