"""Worker processes, the channels to them, and the removal of their processes and files."""
