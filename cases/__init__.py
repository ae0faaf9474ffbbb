"""Scenes, stages and cases of the suite as plain data. This package renders nothing and imports no renderer."""
