"""The 3-D view of a case: its parts, stills of it, and the viewer that turns it."""
