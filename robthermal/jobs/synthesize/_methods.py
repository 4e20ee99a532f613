"""Names of the syntheses that `robthermal design` knows beside the certified limits."""

METHODS = ("hinf", "h2", "mixed", "mu", "output-feedback", "frf-pid", "polytope", "lpv", "tem",
           "anti-windup", "mpc")
