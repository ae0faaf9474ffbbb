"""Whatever may die: worker processes, the channels to them, and what they leave behind."""
