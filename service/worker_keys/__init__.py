"""Worker keys, with which workers on other machines join the farm.

registry       which worker keys are valid, for the messages that workers sign with them
broker_users   the users that worker keys have at the broker, where the service may make users
joining        new worker keys, and the join files of them
"""
