"""One renderer's answers held against another's: what each check measures, pixel by pixel, before any verdict."""
