"""How far two right answers may differ at each pixel, derived from rounding and conditioning."""
