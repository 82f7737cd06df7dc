"""Output of commands on a terminal: progress bars, tables, and results as text or JSON."""
