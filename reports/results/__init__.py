"""A run's data and its files: records, images, the document, the table of cases."""
