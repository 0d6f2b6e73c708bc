"""How memory and time grow with the number of clips: of the process that drives a run, and of what reads its dataset."""
