"""One self-contained page that shows a session's results.

Each panel is one file here, with a class that turns results into plain values and figures, and one
template in `templates/`. A panel copes with results that are not there: it says what to run.
"""
