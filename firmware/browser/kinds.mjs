// The two sketches as the page shows them: what can be disturbed, plotted, compared, and their maps.
import { COLOURS } from "./colours.mjs";
import { crossOf, drawMission } from "./map_mission.mjs";
import { drawTracking } from "./map_tracking.mjs";

const KNOTS = 1.943844;
const percent = (value) => `${value} %`;
const times = (value) => `${value.toFixed(1)}\u00d7 expected`;

const NOISE = { name: "noise", label: "Noise of the sonar", min: 0, max: 4, step: 0.1, value: 1, show: times };
const OUTLIERS = {
  ...{ name: "outliers", label: "Echoes that come too late", min: 0, max: 30, step: 1, value: 0 },
  ...{ scale: 0.01, show: percent },
};
const GATE = 13.8; // kGate of the sketch's config.h
const NIS_SHOWN = 30; // larger ones are drawn there
/** Three standard deviations of the position. */
const spread = (xx, yy) => 3 * Math.sqrt(xx + yy);
const errorOf = ({ x, y, told }) =>
  told === undefined ? NaN : Math.hypot(told.x_m - x, told.y_m - y);

export const KINDS = {
  tracking: {
    speed: 4,
    policies: ["paper\u2019s law", "accuracy", "0.5 s"],
    sliders: [
      NOISE,
      OUTLIERS,
      {
        ...{ name: "wander", label: "Vehicle off its track by", min: 0, max: 3, step: 0.1, value: 0.6 },
        show: (value) => `${value.toFixed(1)} m`,
      },
    ],
    legend: [
      [COLOURS.track, "desired track"],
      [COLOURS.truth, "vehicle"],
      [COLOURS.estimate, "estimate, 3 sigma"],
      [COLOURS.measured, "measured", "dot"],
      [COLOURS.refused, "refused by the gate", "dot"],
    ],
    pairs: [
      ["x_m", "x"],
      ["y_m", "y"],
      ["P00_m2", "P\u2093\u2093"],
      ["interval_s", "interval"],
    ],
    plots: [
      {
        ...{ title: "Interval to the next ping", unit: "s", least: [0, 1] },
        series: [{ colour: COLOURS.estimate, style: "dots", value: (row) => row.interval_s }],
      },
      {
        ...{ title: "Error of the estimate, and its 3 sigma", unit: "m", least: [0, 0.4] },
        series: [
          { colour: COLOURS.estimate, style: "area", value: (row) => spread(row.P00_m2, row.P11_m2) },
          { colour: COLOURS.truth, style: "line", value: (row) => Math.hypot(row.x_m - row.x, row.y_m - row.y) },
        ],
      },
      {
        ...{ title: "NIS", unit: "2 on average; beyond 13.8 the gate refuses", least: [0, 16] },
        series: [
          { colour: COLOURS.track, style: "line", value: () => GATE },
          { colour: COLOURS.estimate, style: "dots", value: ({ nis }) => Math.min(nis, NIS_SHOWN) },
        ],
      },
    ],
    map: drawTracking,
  },
  mission: {
    speed: 10,
    policies: ["0.5 s", "accuracy, 1 m"],
    sliders: [
      {
        ...{ name: "current", label: "Current", min: 0, max: 0.8, step: 0.05, value: 0.3 },
        show: (value) => `${value.toFixed(2)} m/s, ${(value * KNOTS).toFixed(1)} kn`,
      },
      {
        ...{ name: "towards", label: "Current towards", min: 0, max: 360, step: 5, value: 60 },
        ...{ scale: Math.PI / 180, show: (value) => `${value}\u00b0` },
      },
      NOISE,
      OUTLIERS,
    ],
    legend: [
      [COLOURS.track, "plan"],
      [COLOURS.truth, "vehicle"],
      [COLOURS.estimate, "estimate, 3 sigma"],
      [COLOURS.measured, "fix", "dot"],
    ],
    pairs: [
      ["rudder_rad", "rudder"],
      ["x_m", "north"],
      ["y_m", "east"],
      ["current_x_m_s", "current"],
    ],
    plots: [
      {
        ...{ title: "Beside the track", unit: "m: vehicle, and as the pilot sees it", least: [-2, 2] },
        series: [
          { colour: COLOURS.truth, style: "line", value: crossOf },
          { colour: COLOURS.estimate, style: "dots", value: (row) => row.told?.cross_m ?? NaN },
        ],
      },
      {
        ...{ title: "Current to the east", unit: "m/s: true, and as the filter finds it", least: [-0.1, 0.4] },
        series: [
          { colour: COLOURS.truth, style: "line", value: (row) => row.east },
          { colour: COLOURS.estimate, style: "dots", value: (row) => row.told?.current_y_m_s ?? NaN },
        ],
      },
      {
        ...{ title: "Error of the estimate, and its 3 sigma", unit: "m", least: [0, 1] },
        series: [
          { colour: COLOURS.estimate, style: "area", value: ({ told }) => spread(told?.P00_m2, told?.P11_m2) },
          { colour: COLOURS.truth, style: "line", value: errorOf },
        ],
      },
    ],
    map: drawMission,
  },
};
