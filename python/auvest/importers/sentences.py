"""What the sentences of navigation and USBL say, field by field.

NMEA 0183 as gpsd's pages on it describe them; PAZM3 and RTH by their makers (uWAVE, Cerulean);
USBLLONG and USBLANGLES as in Evologics' documentation of its modems. A name that is empty is a
field that tells only a unit. ``@`` marks what is read together: latitude and its hemisphere and so
on.
"""

from __future__ import annotations

from collections.abc import Mapping

#: By the three letters after the talker.
NMEA: Mapping[str, tuple[str, ...]] = {
    "GGA": (
        "@time", "@latitude", "@", "@longitude", "@", "quality", "satellites", "hdop",
        "altitude_m", "", "geoid_m", "", "age_s", "station",
    ),
    "RMC": (
        "@time", "status", "@latitude", "@", "@longitude", "@", "speed_kn", "course_deg", "@date",
        "variation_deg", "variation_to", "mode", "nav_status",
    ),
    "GLL": ("@latitude", "@", "@longitude", "@", "@time", "status", "mode"),
    "GNS": (
        "@time", "@latitude", "@", "@longitude", "@", "mode", "satellites", "hdop", "altitude_m",
        "geoid_m", "age_s", "station", "nav_status",
    ),
    "ZDA": ("@time", "@day", "@month", "@year", "zone_h", "zone_min"),
    "VTG": ("course_deg", "", "course_magnetic_deg", "", "speed_kn", "", "speed_km_h", "", "mode"),
    "HDT": ("heading_deg", ""),
    "HDM": ("heading_magnetic_deg", ""),
    "HDG": (
        "heading_magnetic_deg", "deviation_deg", "deviation_to", "variation_deg", "variation_to",
    ),
    "ROT": ("rate_deg_min", "status"),
    "DPT": ("depth_m", "offset_m", "range_m"),
    "DBT": ("depth_ft", "", "depth_m", "", "depth_fathoms", ""),
    "VBW": ("water_forward_kn", "water_starboard_kn", "water_status", "ground_forward_kn",
            "ground_starboard_kn", "ground_status"),
    "HEV": ("heave_m",),
}  # fmt: skip

#: By all of their name.
PROPRIETARY: Mapping[str, tuple[str, ...]] = {
    "PAZM3": (
        "status", "address", "request", "response", "signal_db", "propagation_s", "slant_range_m",
        "horizontal_range_m", "remote_depth_m", "horizontal_angle_deg", "vertical_angle_deg",
        "pressure_mbar", "temperature_c", "heading_deg", "pitch_deg", "roll_deg",
    ),
    "USRTH": (
        "bearing_mathematical_deg", "bearing_compass_deg", "elevation_deg", "slant_range_m",
        "true_bearing_mathematical_deg", "true_bearing_compass_deg", "true_elevation_deg",
        "roll_deg", "pitch_deg", "yaw_deg", "heading_deg", "signal_db",
    ),
    "USBLLONG": (
        "current_s", "measured_s", "address", "x_m", "y_m", "z_m", "east_m", "north_m", "up_m",
        "roll_rad", "pitch_rad", "yaw_rad", "propagation_us", "rssi_db", "integrity", "accuracy_m",
    ),
    "USBLANGLES": (
        "current_s", "measured_s", "address", "bearing_rad", "elevation_rad", "true_bearing_rad",
        "true_elevation_rad", "roll_rad", "pitch_rad", "yaw_rad", "rssi_db", "integrity",
        "accuracy_rad",
    ),
}  # fmt: skip


def fields_of(name: str) -> tuple[str, ...]:
    """Names of a sentence's fields, none if it is not known here."""
    return PROPRIETARY.get(name) or (NMEA.get(name[2:], ()) if len(name) == 5 else ())
