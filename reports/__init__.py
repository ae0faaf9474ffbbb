"""The top of the stack: runs renderers on cases, judges their answers, publishes the verdicts."""
