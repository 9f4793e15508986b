#!/bin/bash
# The page of `caustica study`.
exec tests/browser/run.sh study "study page"
