#!/bin/bash
# The report of paper 002's comparison.
exec tests/browser/run.sh paper_002 "paper 002's report"
