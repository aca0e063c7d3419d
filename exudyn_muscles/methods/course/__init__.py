"""Where a step really leads: muscles with held excitations, the skeleton under their forces."""
