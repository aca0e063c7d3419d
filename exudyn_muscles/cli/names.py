"""Names, exit states and usual numbers of the command line."""

PROGRAM = "exudyn-muscles"
PAPER = {"static": "Static", "cmc": "CMC", "csf": "CSF", "css": "CSS"}  # its Table 2
METHODS = {**PAPER, "consistent": "Consistent CSF"}
TRACKING = tuple(method for method in METHODS if method != "static")  # those that move a skeleton
DIFFER, FAILED = 1, 2
INTERRUPTED, TERMINATED = 130, 143  # 128 and the number of SIGINT, of SIGTERM

# The paper's step, and the gain that its Table 2 implies.
STEP = 0.01
KP = 534.0
CMC_STEPS = 10  # of the skeleton in a window of CMC
