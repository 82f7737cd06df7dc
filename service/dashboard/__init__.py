"""The dashboard: one page, its static files, and the pages for login, problems and the API. There is no build step.

assets         the static files, with hashes in their URLs
policy         the security headers of pages
api_reference  the description of the API as the sections of a page
pages          the pages and the router

`templates/` contains the documents. `static/` contains:

app       starts the page; login is the script of the login page
api       the requests to the API
live      keeps the state of the page current; store holds it
header    the health of the farm; jobs is the list of jobs
job       one job, with rig, videos, frames and failures
lightbox  one frame in full size: picture (static) and viewer (interactive), with footer and choice
modes     the modes of the viewer; canvas, webgl, shaders and views draw them; remote and request load pictures
submit    the form for a new job, with field and parameters
design    the design of a job
keys      the keys and the browser sessions, for admins
format    formats of numbers; html is the markup
vendor/   third-party packages
"""

from service.dashboard.pages import problem_page, router

__all__ = ["problem_page", "router"]
