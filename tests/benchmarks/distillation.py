"""The distillation column of robust control, closed with its inverse-based controller."""

from __future__ import annotations

import control
import numpy as np


def distillation() -> control.StateSpace:
    """Skogestad and Postlethwaite, section 8.11.3: two input uncertainties, performance, inverse-based controller."""
    G0, one, none = np.array([[87.8, -86.4], [108.2, -109.6]]), np.eye(2), np.zeros((2, 2))
    inverse, through, slow = np.linalg.inv(G0), 0.7 * 75, 0.7 * (1 - 75e-5)
    # states: plant, controller 0.7 (75 s + 1)/(s + 1e-5), weights (s + 0.2)/(0.5 s + 1), 0.5 (10 s + 1)/(10 s + 1e-5)
    A = np.block([[-(1 + through) / 75 * one, slow / 75 * one, none, none], [-one, -1e-5 * one, none, none],
                  [-through * one, slow * one, -2 * one, none], [G0, none, none, -1e-6 * one]])
    B = np.block([[one / 75, -through / 75 * inverse], [none, -inverse], [none, -through * inverse], [none, one]])
    C = np.block([[-2 * through * one, 2 * slow * one, -3.6 * one, none],
                  [0.5 * G0, none, none, 0.5 * (0.1 - 1e-6) * one]])
    D = np.block([[none, -2 * through * inverse], [none, 0.5 * one]])
    return control.ss(A, B, C, D)
