"""Processes: Python workers that compute calls, programs within a time limit, interrupts.

Nothing is left behind. A child leads a session, a program a group in it, and each is ended with these and with all
that it has started. Only a process that has left the session, and whose parent is gone, is out of reach.
"""
