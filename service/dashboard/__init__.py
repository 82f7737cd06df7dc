"""The dashboard: one page, its static files, and the pages for login, problems and the API. There is no build step.

assets         the static files, with hashes in their URLs
bundle         the modules of the page as one file
policy         the security headers of pages
api_reference  the description of the API as the sections of a page
pages          the pages and the router
help_pages     the documentation, and its router

`templates/` contains the documents. `static/` contains `app.js`, which starts the page, and a folder for each part:

api/      the requests to the API, and the page of the API
state/    what the page knows: `store` holds it, `live` keeps it current, `frame_pages` has the frames of the open job
jobs/     one job with rig, videos and failures; list/ of jobs, its frames/, the work/ of its tasks, compare/ of two
viewer/   the viewer of a job: looker puts together its screen, the hand/ (eye, gestures, keys, zoom), time/ (strip,
          player), painting/ with WebGL, depth/, a module for each mode in modes/, and the cast/ to a panel
new-job/  the form for a new job: form/ (fields by the schema), scenes/ (with uploads), animation/ (keyframes), design
farm/     the header with the health of the farm
account/  the login page, and the keys and browser sessions
shared/   markup, formats, and what several parts draw
vendor/   third-party packages
"""

from service.dashboard.help_pages import router as help_router
from service.dashboard.pages import problem_page, router

__all__ = ["help_router", "problem_page", "router"]
