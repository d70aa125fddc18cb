"""Cases in which SlatfJoint and the IMM earn their place."""
