"""Every formula variant on every ladder, held against certified truth."""
