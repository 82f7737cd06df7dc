"""docker-compose.yml and its overrides without Docker: every container is a process that sees what its container would.

composition   the services of a composition as processes, and the lines of a shell that a user types
container     a process behind bubblewrap: a root that cannot be written, volumes and secrets where compose has them
docker        the program `docker` of that shell, with `compose exec`, `run`, `cp` and `logs`
images        the programs of foreign images, made of those that the packages for tests have

Compose itself reads the files. What is not here is what Docker does alone: images are not built, containers share the
network of this machine, so that names and ports are others, and their users are the one that runs the test.
"""
