// Canvases: one that is cleared, in its own pixels, and a plot over time.

const SOFT = "#93adbf";
const GRID = "#1e3d52";
const FONT = "12px system-ui, sans-serif";

/** Its pen, and its size in the page's pixels; empty. */
export function clear(canvas) {
  const ratio = devicePixelRatio;
  const { clientWidth: width, clientHeight: height } = canvas;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = FONT;
  pen.lineJoin = pen.lineCap = "round";
  return { pen, width, height };
}

/** A step of a scale, 1, 2 or 5 times a power of ten, of which at most so many fit. */
export function stepOf(span, most) {
  const least = span / most;
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((n) => n * power).find((step) => step >= least);
}

export class Strip {
  /**
   * `series` have a colour, a value of a row, NaN where there is none, and a style: line, dots, or
   * area from 0. `least` is what the scale reaches in any case: [from, to].
   */
  constructor({ title, unit, series, least }) {
    Object.assign(this, { title, unit, series, least });
    this.canvas = document.createElement("canvas");
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", `${title}, ${unit}`);
  }

  draw(rows) {
    const { pen, width, height } = clear(this.canvas);
    const left = 44;
    const right = 12;
    const top = 28;
    const bottom = 20;
    const end = Math.max(20, rows.at(-1)?.time ?? 0);
    const values = this.series.map(({ value }) => rows.map(value));
    let [low, high] = this.least;
    for (const number of values.flat()) {
      if (number < low) low = number;
      if (number > high) high = number;
    }
    const x = (time) => left + (time / end) * (width - left - right);
    const y = (value) => height - bottom - ((value - low) / (high - low)) * (height - top - bottom);

    pen.strokeStyle = GRID;
    pen.fillStyle = SOFT;
    pen.lineWidth = 1;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    const step = stepOf(high - low, 4);
    for (let k = Math.ceil(low / step); k * step <= high + 1e-9; ++k) {
      pen.beginPath();
      pen.moveTo(left, y(k * step));
      pen.lineTo(width - right, y(k * step));
      pen.stroke();
      pen.fillText(String(Number((k * step).toPrecision(6))), left - 6, y(k * step));
    }
    pen.textAlign = "center";
    const seconds = stepOf(end, Math.max(2, width / 90));
    for (let time = 0; time <= end; time += seconds) {
      pen.fillText(`${time}`, x(time), height - bottom / 2);
    }
    pen.textAlign = "left";
    pen.textBaseline = "alphabetic";
    pen.font = `600 ${FONT}`;
    pen.fillStyle = "#e8f1f7";
    pen.fillText(this.title, left, 18);
    const titled = left + pen.measureText(this.title).width + 8;
    pen.font = FONT;
    pen.fillStyle = SOFT;
    pen.fillText(this.unit, titled, 18);

    this.series.forEach((one, i) => this.plot(pen, one, rows, values[i], x, y));
  }

  plot(pen, { colour, style }, rows, values, x, y) {
    pen.strokeStyle = pen.fillStyle = colour;
    if (style === "dots") {
      rows.forEach((row, i) => {
        if (Number.isNaN(values[i])) return;
        pen.beginPath();
        pen.arc(x(row.time), y(values[i]), 2.2, 0, 7);
        pen.fill();
      });
      return;
    }
    pen.lineWidth = 1.7;
    pen.beginPath();
    let first = null;
    let end = null;
    rows.forEach((row, i) => {
      if (Number.isNaN(values[i])) return;
      first ??= row.time;
      end = row.time;
      pen.lineTo(x(row.time), y(values[i]));
    });
    if (style === "area" && first !== null) {
      pen.lineTo(x(end), y(0));
      pen.lineTo(x(first), y(0));
      pen.globalAlpha = 0.22;
      pen.fill();
      pen.globalAlpha = 1;
    } else {
      pen.stroke();
    }
  }
}
