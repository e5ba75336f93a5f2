"""Many scans: work that outlasts one machine, and what it leaves behind."""
