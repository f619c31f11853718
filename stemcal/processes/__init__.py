"""Processes: Python workers that execute function calls, programs with a time limit, and interrupts.

A worker or program is terminated together with all processes that it started: the members of its session or process
group and its descendants. Only a process that left the session and whose parent has ended cannot be found.
"""
