"""The designer: what a job will give, in numbers, before anything is rendered."""
