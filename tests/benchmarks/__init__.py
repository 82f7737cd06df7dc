"""`make bench`: what Lippmann costs, as ratios in one run and against limits. Never part of the tests."""
