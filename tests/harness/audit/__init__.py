"""The audit: plant faults one at a time and see whether the harness kills each, and blames the right stage and side.

`planted` lists the faults and chooses the cases that could see each, `tasks` do one order in a worker, `findings` adds
the sightings up, `suite` runs it all.
"""
