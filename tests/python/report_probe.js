// Runs in a report before the page's own policy is known: says what was seen after STEPS.
const trouble = [];
addEventListener("error", (e) => trouble.push(String(e.message || e.target.src)), true);
addEventListener("securitypolicyviolation", (e) => trouble.push(e.violatedDirective));
console.error = console.warn = (...what) => trouble.push(what.join(" "));
const $ = (what) => document.querySelector(what);
const later = () => new Promise((done) => setTimeout(done, 20));
function look() {
  const charts = [...document.querySelectorAll("#charts figure")].map((f) => [f.id, {
    from: Number(f.dataset.from), to: Number(f.dataset.to), cursor: Number(f.dataset.cursor),
    values: JSON.parse(f.dataset.values), said: f.querySelector("output").textContent}]);
  const map = $("#map").dataset;
  return {charts: Object.fromEntries(charts), tip: $("#tip").hidden ? null : $("#tip").textContent,
    now: $("#now").textContent,
    map: Object.fromEntries(["x", "y", "scale", "from", "to", "cursor", "at"].map((n) => [n, JSON.parse(map[n])]))};
}
function point(x, y) {
  const box = $("#map .over").getBoundingClientRect(), {map} = look();
  return {clientX: box.left + box.width / 2 + (x - map.x) * map.scale,
    clientY: box.top + box.height / 2 - (y - map.y) * map.scale, bubbles: true, pointerId: 1};
}
const hover = (x, y) => $("#map .over").dispatchEvent(new PointerEvent("pointermove", point(x, y)));
const press = (what, key) => { $(what).focus(); document.activeElement.dispatchEvent(new KeyboardEvent("keydown", {key, bubbles: true})); };
const slide = (time) => { $("#time").value = time; $("#time").dispatchEvent(new Event("input")); };
// The pixels of the map about a place.
function colours(x, y) {
  const canvas = $("#map canvas"), box = canvas.getBoundingClientRect(), at = point(x, y);
  const share = canvas.width / box.width, edge = 5;
  const [left, top] = [at.clientX - box.left, at.clientY - box.top].map((v) => Math.round(v * share) - 2);
  const all = [...canvas.getContext("2d").getImageData(left, top, edge, edge).data];
  return Array.from({length: edge * edge}, (_, k) => all.slice(4 * k, 4 * k + 4));
}
addEventListener("load", async () => {
  const seen = {};
  const step = async (name, act) => { await act(); await later(); seen[name] = look(); };
  try { await (async () => {
STEPS;
})(); } catch (error) { trouble.push(String(error)); }
  await later();
  const loaded = performance.getEntriesByType("resource").map((e) => e.name.slice(0, 30));
  document.documentElement.dataset.seen = JSON.stringify({seen, loaded, trouble, drawn: "drawnMs" in document.documentElement.dataset});
});
