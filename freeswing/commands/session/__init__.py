"""Commands on a recorded session, in the order in which a day runs."""
