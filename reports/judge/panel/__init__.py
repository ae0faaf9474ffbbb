"""Several renderers' answers together: who stands alone, whose defects are known, and whom the others outvote."""
