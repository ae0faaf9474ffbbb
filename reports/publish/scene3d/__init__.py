"""The 3-D views of a case: what is drawn, by whom, and the viewer that turns it."""
