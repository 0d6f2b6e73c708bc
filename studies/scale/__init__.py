"""How memory and time grow with the number of clips: of what drives a run, and of what reads its dataset."""
