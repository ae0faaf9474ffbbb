"""The data of a run as it is written and read: outcomes, images and the document of results."""
