"""The 3-D view of a case: its parts, still images, and the interactive viewer."""
