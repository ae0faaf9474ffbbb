"""A run's data as written and read: records, images, the document, the table of cases."""
