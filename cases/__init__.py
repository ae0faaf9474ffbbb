"""What is asked: scenes, stages and cases as plain data. Renders nothing and imports no renderer."""
