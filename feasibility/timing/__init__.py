"""Time along a path, within the limits of joints, tool and controller."""
