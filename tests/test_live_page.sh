#!/bin/bash
# The page of `caustica render --serve`.
exec tests/browser/run.sh live "the live view"
