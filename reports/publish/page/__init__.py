"""The report that opens in a browser: its data, its pages, and the scripts that show them."""
