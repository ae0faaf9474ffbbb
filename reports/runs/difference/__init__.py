"""Two finished runs side by side: what changed its verdict and by how much, as a record and as a results folder."""
