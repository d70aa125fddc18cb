// What a reader of a report does; PLACE is where the craft is at 10 s, and the range that is too long
// is REACH times as long as the way to the beacon.
await step("opened", () => {});
seen.order = [...document.querySelectorAll("input, button, [tabindex]")].map((e) => e.id || e.dataset.act || e.closest("figure")?.id || e.type);
seen.nameless = [...document.querySelectorAll("input, button, canvas[tabindex]")].filter((e) => !(e.ariaLabel || e.textContent || e.labels?.[0]?.textContent)).length;
seen.colours = colours(...PLACE);
await step("hovered", () => hover(10, 0));
await step("left", () => hover(10, 200));
await step("zoomed", () => $("[data-act=in]").click());
await step("later", () => $("[data-act=later]").click());
await step("all", () => $("[data-act=all]").click());
await step("slid", () => slide(20));
await step("key", () => press("#nis .over", "ArrowRight"));
await step("plus", () => press("#weight .over", "+"));
await step("zero", () => press("#weight .over", "0"));
await step("nearer", () => press("#map .over", "+"));
await step("moved", () => press("#map .over", "ArrowRight"));
await step("fitted", () => press("#map .over", "0"));
await step("rejected", () => hover(20 + REACH * (31 - 20), 15 - REACH * 15));
await step("chart", () => {
  const box = $("#nis .over").getBoundingClientRect();
  $("#nis .over").dispatchEvent(new PointerEvent("pointermove", {clientX: box.left + 52 + (box.width - 62) * 0.5, clientY: box.top + 30, bubbles: true}));
});
