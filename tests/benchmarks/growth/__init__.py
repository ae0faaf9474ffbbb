"""What a run costs as the suite grows: suites of ever more small scenes, run from nothing and run again."""
