"use strict";
// Plots are drawn when they come into view, so that a report with many recordings opens at once.
const config = { responsive: true, displaylogo: false, displayModeBar: false };
const touch = matchMedia("(pointer: coarse)").matches;
const PAPER = { width: 702, gap: 12, height: 350, flatter: 0.7 }; // px of the text on A4, and of a figure at most
const drawn = new WeakSet();

function draw(box) {
  if (drawn.has(box) || box.closest("details:not([open])")) return;
  show(box);
}

function show(box, fit = fitScreen) {
  drawn.add(box);
  const figure = JSON.parse(box.nextElementSibling.textContent);
  fit(figure.layout, box);
  Plotly.react(box, figure.data, figure.layout, config);
}

function fitScreen(layout, box) {
  Object.assign(box.style, { width: "", height: `${layout.height}px` });
  // On a touch screen a finger on a plot should scroll the page.
  if (touch) layout.dragmode = false;
  if (box.clientWidth < 500) {
    Object.assign(layout.margin, { l: 56, r: 4 });
    layout.font.size = 11;
  }
}

// Side by side where figures belong together, with the names of axes in two lines in low rows.
function fitPaper(layout, box) {
  const pair = box.closest(".figures")?.childElementCount > 1;
  const shrunk = pair ? 0.5 : 0.6;
  layout.width = (pair ? (PAPER.width - PAPER.gap) / 2 : PAPER.width) / shrunk;
  const flatter = box.closest("#glance") ? 1 : PAPER.flatter;
  layout.height = Math.min(flatter * layout.height, PAPER.height / shrunk);
  Object.assign(box.style, { width: `${layout.width}px`, height: `${layout.height}px` });
  box.style.setProperty("--shrunk", shrunk);
  layout.margin.l = Math.max(layout.margin.l, 84);
  for (const [key, axis] of Object.entries(layout)) {
    if (!key.startsWith("yaxis") || !axis.title?.text) continue;
    axis.title = { ...axis.title, text: axis.title.text.replace(" [", "<br>["), font: { size: 10 } };
  }
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
  let folded = [];
  addEventListener("beforeprint", () => {
    folded = [...document.querySelectorAll("details:not([open])")];
    folded.forEach((fold) => { fold.open = true; });
    boxes.forEach((box) => show(box, fitPaper));
  });
  addEventListener("afterprint", () => {
    boxes.forEach((box) => show(box));
    folded.forEach((fold) => { fold.open = false; });
  });
});

const nav = document.querySelector("nav");
for (const heading of document.querySelectorAll("section > h2")) {
  const link = document.createElement("a");
  link.href = "#" + heading.parentElement.id;
  link.textContent = heading.textContent;
  nav.append(link);
}
