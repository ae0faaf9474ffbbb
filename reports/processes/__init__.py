"""Worker processes, the channels to them, and what they leave behind when they die."""
