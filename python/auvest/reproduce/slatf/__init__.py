"""The SLATF paper: Lu, Chen, Liu, Ma, He 2020."""
