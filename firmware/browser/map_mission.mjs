// The map of the mission: all lanes of its plan, in the current. North is up.
import { COLOURS } from "./colours.mjs";
import { View } from "./view.mjs";

/** North and east [m]: plan.h of the sketch. */
const PLAN = [
  ...[[20, 20], [140, 20], [140, 60], [20, 60]],
  ...[[20, 100], [140, 100], [140, 140], [20, 140]],
];
const MIDDLE = 80;
const SPAN = 176; // [m]
const FIXES = 60; // the last so many are shown
const ARROWS = 32; // between arrows of the current [m]

/** How far the vehicle is to starboard of the leg that its pilot is on [m]. */
export function crossOf({ x, y, told }) {
  if (told === undefined) return NaN;
  const [from, to] = PLAN.slice(told.leg, told.leg + 2);
  const [ahead, right] = [to[0] - from[0], to[1] - from[1]];
  return ((y - from[1]) * ahead - (x - from[0]) * right) / Math.hypot(ahead, right);
}

export function drawMission(canvas, rows) {
  const { pen } = canvas;
  const view = new View(canvas, MIDDLE, MIDDLE, SPAN);
  view.grid();
  const now = rows.at(-1);
  if (now !== undefined) current(view, now);
  const told = rows.findLast((row) => row.told !== undefined)?.told;
  view.line(PLAN.map(([north, east]) => [east, north]), COLOURS.track, 1.5, [7, 6]);
  if (told !== undefined) {
    const leg = PLAN.slice(told.leg, told.leg + 2);
    view.line(leg.map(([north, east]) => [east, north]), "#a9c4d6", 2.5);
  }
  PLAN.forEach(([north, east]) => view.dot(east, north, 3, COLOURS.track));
  view.dot(0, 0, 4, COLOURS.measured);
  pen.fillStyle = COLOURS.measured;
  pen.textAlign = "left";
  pen.fillText("USBL", view.x(0) + 9, view.y(0) + 4);
  if (now === undefined) return;
  const fixes = rows.slice(-6 * FIXES).filter(({ fix }) => fix !== null).slice(-FIXES);
  fixes.forEach(({ fix }, i) => {
    pen.globalAlpha = 0.15 + (0.75 * i) / fixes.length;
    view.dot(fix.y, fix.x, 2.2, COLOURS.measured);
    pen.globalAlpha = 1;
  });
  view.line(rows.map(({ x, y }) => [y, x]), COLOURS.truth, 2.2);
  if (told !== undefined) {
    view.ellipse(told.y_m, told.x_m, [told.P11_m2, told.P10_m2, told.P00_m2], COLOURS.estimate, true);
    view.dot(told.y_m, told.x_m, 3, COLOURS.estimate);
  }
  view.vehicle(now.y, now.x, now.yaw, COLOURS.truth, told?.rudder_rad ?? 0);
}

/** Arrows all over the map, as long as the current drifts in half a minute. */
function current(view, { north, east }) {
  const { pen } = view;
  const length = Math.hypot(north, east);
  if (length < 0.005) return;
  const course = Math.atan2(east, north);
  pen.strokeStyle = "#2a5570";
  pen.lineWidth = 1.4;
  const reach = 30 * length * view.scale;
  for (let row = -8; row <= 12; ++row) {
    for (let column = -8; column <= 12; ++column) {
      pen.save();
      pen.translate(view.x(column * ARROWS), view.y(row * ARROWS));
      pen.rotate(course);
      pen.beginPath();
      pen.moveTo(0, reach / 2);
      pen.lineTo(0, -reach / 2);
      pen.lineTo(-3, -reach / 2 + 5);
      pen.moveTo(0, -reach / 2);
      pen.lineTo(3, -reach / 2 + 5);
      pen.stroke();
      pen.restore();
    }
  }
}
