"""What is asked: scenes, stages and cases as plain data. This package renders nothing and imports no renderer."""
