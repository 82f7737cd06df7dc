"""The work of a farm on this machine, without a farm."""
