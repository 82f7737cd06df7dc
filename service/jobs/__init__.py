"""The rules of jobs: what happens to the rows of a job, from its submission to its end.

submission       stores a job file as a job
state_machine    transitions of jobs and tasks, guarded by the tables of `lippmann.job.states`
planner          creates the tasks of a job from the result of its probe
commands         what users ask for: cancel, pause, resume, retry, repair, skip, prioritise, remove
skipping         leaves frames out, and brings them back
farm_pause       pauses jobs whose work a full disk or another fault prevents, and lets them go on
task_draft       a task in memory, which rules change: pure
fair_share       divides the free orders between jobs: pure
waiting          why a job or a task waits: pure
completion       ends jobs whose tasks have ended
verification     whether what done tasks stored is still there and whole
artifact_repair  takes back done tasks whose artifacts are missing or damaged
artifact_guard   verifies what a request reads, and has it made again if it is damaged
"""
