"""The vehicle in the loop: the closed-loop table, beside the values of an independent prototype."""
