"""The doctor examines a farm's database, store and settings, and repairs what can be repaired.

finding      what an examination finds
broker       the way to the broker
schema       whether the database is whole and has the schema of this version
task_checks  invariants of tasks: who holds them, and when they wait
job_checks   invariants of jobs: counters, plans, ends
usage_checks invariants of what owners have stored
farm_checks  invariants of the coordinator's row and of stop requests
store        artifacts of done tasks, orphans, partial files, space
settings     settings that contradict each other
repair       repairs, by the functions that the coordinator uses
examine      all checks in order, and the repair of what they found
"""
