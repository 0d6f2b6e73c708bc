"""Runs that are killed, files that rot, disks that are full: what the bytes are afterwards."""
