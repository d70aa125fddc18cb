// The map of the tracking loop: it stays with the vehicle, and a small one shows the whole track.
import { COLOURS } from "./colours.mjs";
import { View } from "./view.mjs";

const STATION = [0.2, 2]; // [m], RangeBearing's
const LENGTH = 60; // of a run [s]
const SHOWN = 40; // estimates with their ellipses
const SPAN = 4.5; // [m]

/** Constant acceleration from the start, as in the paper. */
function desired(time) {
  return [0.2 + time * (0.1 + 0.005 * time), 2 + time * (0.2 + 0.01 * time)];
}
const TRACK = Array.from({ length: LENGTH + 3 }, (_, time) => desired(time));

const measured = ({ range, bearing }) => [
  STATION[0] + range * Math.cos(bearing),
  STATION[1] + range * Math.sin(bearing),
];

export function drawTracking(canvas, rows) {
  const now = rows.at(-1) ?? { x: STATION[0], y: STATION[1], time: 0 };
  const { pen, width, height } = canvas;
  const sigma = Math.sqrt((now.P00_m2 ?? 0) + (now.P11_m2 ?? 0));
  const view = new View(canvas, now.x, now.y, Math.min(40, Math.max(SPAN, 14 * sigma)));
  view.grid();
  view.line(TRACK, COLOURS.track, 1.5, [7, 6]);
  const recent = rows.slice(-SHOWN);
  recent.forEach((row, i) => {
    pen.globalAlpha = 0.25 + (0.75 * i) / recent.length;
    const at = measured(row);
    if (row.status !== 0) {
      view.line([[row.x_m, row.y_m], at], COLOURS.refused, 1);
      view.dot(...at, 4, COLOURS.refused);
    } else {
      view.dot(...at, 2.6, COLOURS.measured);
    }
    pen.globalAlpha = 1;
  });
  view.line(rows.map(({ x, y }) => [x, y]), COLOURS.truth, 2);
  const before = rows.at(-2) ?? { x: now.x - 1, y: now.y - 2 };
  view.vehicle(now.x, now.y, Math.atan2(now.x - before.x, now.y - before.y), COLOURS.truth);
  view.line(recent.map(({ x_m, y_m }) => [x_m, y_m]), COLOURS.estimate, 1.2);
  recent.forEach(({ x_m, y_m, P00_m2, P10_m2, P11_m2 }, i) => {
    const last = i === recent.length - 1;
    pen.globalAlpha = last ? 1 : (0.5 * i) / recent.length;
    view.ellipse(x_m, y_m, [P00_m2, P10_m2, P11_m2], COLOURS.estimate, last);
    pen.globalAlpha = 1;
    view.dot(x_m, y_m, last ? 4 : 2, COLOURS.estimate);
  });
  if (rows.length > 0) view.line([STATION, measured(now)], "#93adbf55", 1, [2, 5]);
  overview({ pen, width, height }, now);
}

/** The whole track, with the station and where the vehicle is, in the lower left corner. */
function overview({ pen, width, height }, now) {
  const size = Math.min(150, 0.34 * Math.min(width, height));
  const margin = 12;
  pen.save();
  pen.translate(margin, height - size - margin);
  pen.fillStyle = "#07131dcc";
  pen.strokeStyle = "#1e3d52";
  pen.lineWidth = 1;
  pen.beginPath();
  pen.roundRect(0, 0, size, size, 8);
  pen.fill();
  pen.stroke();
  const [east, north] = desired(LENGTH);
  const small = new View({ pen, width: size, height: size }, east / 2, north / 2, 1.2 * north);
  small.line(TRACK, COLOURS.track, 1.5);
  small.dot(...STATION, 3.5, COLOURS.measured);
  small.dot(now.x, now.y, 4, COLOURS.truth);
  pen.fillStyle = COLOURS.measured;
  pen.textAlign = "left";
  pen.fillText("station", small.x(STATION[0]) + 8, small.y(STATION[1]) + 4);
  pen.restore();
}
