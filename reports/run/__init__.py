"""From a request to a results folder: plan, tasks in worker processes, journal, totals."""
