#!/bin/bash
# The page of `caustica compare --html`.
exec tests/browser/run.sh report "pages"
