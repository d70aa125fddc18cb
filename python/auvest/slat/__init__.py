"""Simultaneous localisation and tracking: SLATF, its relatives and the outage switch.

A slave vehicle that can only dead-reckon pings masters with its own sonar (Lu, Chen, Liu, Ma, He
2020).
"""

from auvest.slat._base import (
    MAX_MASTERS,
    UNKNOWN_MASTER,
    ParticleSlatFilter,
    Resampling,
    SlatFilter,
)
from auvest.slat.dead_reckoning import DeadReckoning
from auvest.slat.ekf_slat import MAX_IMM_MASTERS, EkfSlat
from auvest.slat.models import no_harm
from auvest.slat.outage import Outage
from auvest.slat.results import SlatRun
from auvest.slat.slatf import (
    MAX_PARTICLES,
    Lanes,
    OverconfidenceWarning,
    Slatf,
    available_lanes,
)
from auvest.slat.slatf_joint import SlatfJoint

__all__ = [
    "MAX_IMM_MASTERS",
    "MAX_MASTERS",
    "MAX_PARTICLES",
    "UNKNOWN_MASTER",
    "DeadReckoning",
    "EkfSlat",
    "Lanes",
    "Outage",
    "OverconfidenceWarning",
    "ParticleSlatFilter",
    "Resampling",
    "SlatFilter",
    "SlatRun",
    "Slatf",
    "SlatfJoint",
    "available_lanes",
    "no_harm",
]
