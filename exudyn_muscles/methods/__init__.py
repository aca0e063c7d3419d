"""The methods of the paper, one file and one main loop each."""
