// What each thing has as its colour, on maps and plots.
export const COLOURS = {
  estimate: "#56b4e9",
  truth: "#f0e442",
  measured: "#93adbf",
  refused: "#ff7f50",
  track: "#6f8ea3",
};
