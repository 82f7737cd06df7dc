"""What only a browser can tell: the dashboard in Chromium, on a real service, with a worker played by the test.

studio     pictures, videos and a worker that hands them in when the test says so
conftest   broker, service, browser; a page that may not complain nor leave the state
"""
