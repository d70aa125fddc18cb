"""SLATF and EKF-SLAT with an IMM master on real robots."""
