"""Many pixels at once in pairs of float64 with rigorous radii: what they decide and enclose needs no ball."""
