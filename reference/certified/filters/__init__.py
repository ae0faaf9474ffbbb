"""Float64 with margins, ahead of the balls: what surely does not matter is left out. A filter never decides."""
