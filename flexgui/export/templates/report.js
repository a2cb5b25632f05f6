"use strict";
// Plots are drawn when they come into view, so that a report with many recordings opens at once.
const config = { responsive: true, displaylogo: false, displayModeBar: false };
const touch = matchMedia("(pointer: coarse)").matches;
const PAPER = 660; // px of the text on A4 with its margins
const drawn = new WeakSet();

function draw(box) {
  if (drawn.has(box) || box.closest("details:not([open])")) return;
  drawn.add(box);
  const figure = JSON.parse(box.nextElementSibling.textContent);
  // On a touch screen a finger on a plot should scroll the page.
  if (touch) figure.layout.dragmode = false;
  if (box.clientWidth < 500) {
    Object.assign(figure.layout.margin, { l: 56, r: 4 });
    figure.layout.font.size = 11;
  }
  Plotly.newPlot(box, figure.data, figure.layout, config);
}

// plotly.js travels packed; it is unpacked here, and nothing is loaded from anywhere.
async function unpack(element) {
  const bytes = Uint8Array.from(atob(element.textContent.trim()), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  const script = document.createElement("script");
  script.textContent = await new Response(stream).text();
  document.head.append(script);
}

const boxes = [...document.querySelectorAll(".plot")];
const watcher = new IntersectionObserver(
  (entries) => entries.filter((entry) => entry.isIntersecting).forEach((entry) => draw(entry.target)),
  { rootMargin: "400px" },
);
// The rest follows one by one while nothing else happens: scrolling never meets an empty frame.
function drawRest(rest) {
  const next = rest.find((box) => !drawn.has(box) && !box.closest("details:not([open])"));
  if (next) {
    draw(next);
    setTimeout(drawRest, 30, rest);
  }
}
unpack(document.getElementById("plotly")).then(() => {
  boxes.forEach((box) => watcher.observe(box));
  setTimeout(drawRest, 200, boxes);
  document.addEventListener("toggle", (event) => event.target.querySelectorAll(".plot").forEach(draw), true);
  addEventListener("beforeprint", () => boxes.forEach((box) => {
    draw(box);
    if (drawn.has(box)) Plotly.relayout(box, { width: Math.min(box.clientWidth, PAPER) });
  }));
  addEventListener("afterprint", () => boxes.forEach(
    (box) => drawn.has(box) && Plotly.relayout(box, { width: box.clientWidth })));
});

const nav = document.querySelector("nav");
for (const heading of document.querySelectorAll("section > h2")) {
  const link = document.createElement("a");
  link.href = "#" + heading.parentElement.id;
  link.textContent = heading.textContent;
  nav.append(link);
}
