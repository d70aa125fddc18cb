"""The M-estimation EKF paper: Li, Du, Fan, Chen, Mao, Luo 2020."""
