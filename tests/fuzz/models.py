def check(rng):
    return "x"
