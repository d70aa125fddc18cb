// A map's view: metres to pixels, and what both maps draw.
import { stepOf } from "./strip.mjs";

const GRID = "#143247";
const SOFT = "#93adbf";

export class View {
  /** The middle of the map [m], and how many metres its shorter side shows. East is right. */
  constructor({ pen, width, height }, east, north, span) {
    Object.assign(this, { pen, width, height, east, north });
    this.scale = Math.min(width, height) / span;
  }

  x(east) {
    return this.width / 2 + (east - this.east) * this.scale;
  }
  y(north) {
    return this.height / 2 - (north - this.north) * this.scale;
  }

  grid() {
    const { pen, width, height, scale } = this;
    const step = stepOf(width / scale, Math.max(3, width / 110));
    pen.strokeStyle = GRID;
    pen.lineWidth = 1;
    pen.beginPath();
    const begin = (middle, size) => Math.ceil((middle - size / 2 / scale) / step);
    for (let k = begin(this.east, width); this.x(k * step) < width; ++k) {
      pen.moveTo(this.x(k * step), 0);
      pen.lineTo(this.x(k * step), height);
    }
    for (let k = begin(this.north, height); this.y(k * step) > 0; ++k) {
      pen.moveTo(0, this.y(k * step));
      pen.lineTo(width, this.y(k * step));
    }
    pen.stroke();
    // How long a step is.
    const right = width - 16;
    const below = height - 16;
    pen.strokeStyle = pen.fillStyle = SOFT;
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(right - step * scale, below - 4);
    pen.lineTo(right - step * scale, below);
    pen.lineTo(right, below);
    pen.lineTo(right, below - 4);
    pen.stroke();
    pen.textAlign = "right";
    pen.textBaseline = "alphabetic";
    pen.fillText(`${step} m`, right - 4, below - 6);
  }

  /** A line through points [east, north]. */
  line(points, colour, width, dash = []) {
    const { pen } = this;
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.setLineDash(dash);
    pen.beginPath();
    for (const [east, north] of points) pen.lineTo(this.x(east), this.y(north));
    pen.stroke();
    pen.setLineDash([]);
  }

  dot(east, north, radius, colour) {
    const { pen } = this;
    pen.fillStyle = colour;
    pen.beginPath();
    pen.arc(this.x(east), this.y(north), radius, 0, 7);
    pen.fill();
  }

  /** Three sigma of a position, of its covariance. */
  ellipse(east, north, [ee, en, nn], colour, fill) {
    const { pen } = this;
    const middle = (ee + nn) / 2;
    const apart = Math.hypot((ee - nn) / 2, en);
    const [long, short] = [middle + apart, Math.max(0, middle - apart)].map(
      (variance) => 3 * Math.sqrt(variance) * this.scale,
    );
    pen.beginPath();
    pen.ellipse(this.x(east), this.y(north), long, short, -0.5 * Math.atan2(2 * en, ee - nn), 0, 7);
    if (fill) {
      pen.fillStyle = colour;
      pen.globalAlpha = 0.18;
      pen.fill();
      pen.globalAlpha = 1;
    }
    pen.strokeStyle = colour;
    pen.lineWidth = fill ? 2 : 1;
    pen.stroke();
  }

  /** A torpedo; the course is from north, clockwise [rad]. */
  vehicle(east, north, course, colour, rudder = 0) {
    const { pen } = this;
    const length = 30;
    pen.save();
    pen.translate(this.x(east), this.y(north));
    pen.rotate(course);
    pen.shadowColor = colour;
    pen.shadowBlur = 14;
    pen.fillStyle = colour;
    pen.beginPath();
    pen.roundRect(-3.5, -length / 2, 7, length, 3.5);
    pen.fill();
    pen.shadowBlur = 0;
    pen.translate(0, length / 2 - 2);
    pen.rotate(rudder);
    pen.fillRect(-1.2, 0, 2.4, 10);
    pen.restore();
  }
}
