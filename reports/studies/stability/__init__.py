"""The stability study: every formula variant on every ladder, compared with certified truth."""
