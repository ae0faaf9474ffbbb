"""The topmost package: run renderers on cases, judge their answers, publish the verdicts."""
