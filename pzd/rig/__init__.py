"""Rig records: measured files or a virtual stand, checked before anything is fitted."""
