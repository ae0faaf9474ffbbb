"""Soak: runs that are disturbed on purpose - killed, stopped, starved - must lose nothing and leave nothing behind.

`site` is where the runs take place and what an undisturbed one finds; `disturbing` hits processes that a run started;
`rounds` disturbs a run and resumes it until it is whole. Only processes below the soak's own are ever touched.
"""
