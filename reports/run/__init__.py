"""Running: from a request to a results folder - plan, worker processes, journal, one judged case after another."""
