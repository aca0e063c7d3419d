"""Who pulls how hard: reachable forces (8), (9), optimization (10) and excitation (11)."""
