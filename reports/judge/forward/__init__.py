"""The forward limits: counted roundings times the condition of each pixel, and factors that many pixels share."""
