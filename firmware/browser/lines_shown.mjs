/** How many lines of the chip the page shows: it needs no more of those that have come at once. */
export const LINES = 9;
