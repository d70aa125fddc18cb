"""The AUKF paper: Deng, Yin, Duan 2019."""
