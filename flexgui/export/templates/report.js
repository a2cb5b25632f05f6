"use strict";
// Plots are drawn when they come into view, so that a report with many recordings opens at once.
const config = { responsive: true, displaylogo: false, displayModeBar: false };
const touch = matchMedia("(pointer: coarse)").matches;
const PAPER = { width: 702, gap: 12, height: 350, page: 900, flatter: 0.7 }; // px of the text on A4, and of a figure at most
const PRINTED = 0.66, PRINTED_SMALL = 0.59; // of the screen's size of text: in tables, and in matrices and equations
const LEAST_ZOOM = 0.4;
const drawn = new WeakSet();

function draw(box) {
  if (drawn.has(box) || box.closest("details:not([open])")) return;
  show(box);
}

function show(box, fit = fitScreen) {
  drawn.add(box);
  const figure = structuredClone(figures[box.dataset.figure]);
  fit(figure, box);
  Plotly.react(box, figure.data, figure.layout, config);
}

function fitScreen({ layout }, box) {
  Object.assign(box.style, { width: "", height: `${layout.height}px` });
  // On a touch screen a finger on a plot should scroll the page.
  if (touch) layout.dragmode = false;
  if (box.clientWidth < 500) {
    Object.assign(layout.margin, { l: 56, r: 4 });
    layout.font.size = 11;
  }
}

// Side by side where figures belong together, with the names of axes in two lines in low rows.
function fitPaper({ data, layout }, box) {
  const pair = box.closest(".figures")?.childElementCount > 1;
  const shrunk = pair ? 0.5 : 0.6;
  layout.width = (pair ? (PAPER.width - PAPER.gap) / 2 : PAPER.width) / shrunk;
  // Rows with names and numbers need their height.
  const named = data[0].type !== "heatmap" && Object.entries(layout).some(([key, axis]) => key.startsWith("yaxis") && axis.ticktext);
  if (!named) layout.height = Math.min(PAPER.flatter * layout.height, PAPER.height / shrunk);
  layout.height = Math.min(layout.height, PAPER.page / shrunk);
  Object.assign(box.style, { width: `${layout.width}px`, height: `${layout.height}px` });
  box.style.setProperty("--shrunk", shrunk);
  layout.margin.l = Math.max(layout.margin.l, 84);
  for (const [key, axis] of Object.entries(layout)) {
    if (!key.startsWith("yaxis") || !axis.title?.text) continue;
    axis.title = { ...axis.title, text: axis.title.text.replace(" [", "<br>["), font: { size: 10 } };
  }
}

// A table or equation wider than the paper is drawn smaller; a browser would shrink the whole page.
function fitText(wide) {
  const smaller = (wide.matches(".matrix, math") ? PRINTED_SMALL : PRINTED) * wide.scrollWidth;
  const there = wide.closest(".halves, .equations") ? (PAPER.width - PAPER.gap) / 2 : PAPER.width;
  wide.style.zoom = smaller > there ? Math.max(there / smaller, LEAST_ZOOM) : "";
}

// Figures and plotly.js travel packed; they are unpacked here, and nothing is loaded from anywhere.
async function unpack(id) {
  const text = document.getElementById(id).textContent.trim();
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

function read(buffer) {
  const [length] = new Uint32Array(buffer, 0, 1);
  const text = new TextDecoder().decode(new Uint8Array(buffer, 4, length));
  const begin = 4 + length;
  return JSON.parse(text, (key, value) => (value?.vector === undefined ? value : numbers(buffer, begin, value)));
}

// Differences of 16-bit steps, all high bytes before all low ones; float32 where no step is stated.
function numbers(buffer, begin, { vector, count, low, step }) {
  const start = begin + vector;
  if (step === undefined) return new Float32Array(buffer.slice(start, start + 4 * count));
  const bytes = new Uint8Array(buffer, start, 2 * count);
  let code = 0;
  return Float32Array.from({ length: count }, (none, k) => {
    code = (code + 256 * bytes[k] + bytes[count + k]) & 65535;
    return code === 65535 ? NaN : low + code * step;
  });
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
let figures = [];
Promise.all([unpack("figures"), unpack("plotly")]).then(([packed, plotly]) => {
  figures = read(packed);
  const script = document.createElement("script");
  script.textContent = new TextDecoder().decode(plotly);
  document.head.append(script);
  boxes.forEach((box) => watcher.observe(box));
  setTimeout(drawRest, 200, boxes);
  document.addEventListener("toggle", (event) => event.target.querySelectorAll(".plot").forEach(draw), true);
  let folded = [];
  addEventListener("beforeprint", () => {
    folded = [...document.querySelectorAll("details:not([open])")];
    folded.forEach((fold) => { fold.open = true; });
    boxes.forEach((box) => show(box, fitPaper));
    document.querySelectorAll(".scroll > *").forEach(fitText);
  });
  addEventListener("afterprint", () => {
    boxes.forEach((box) => show(box));
    document.querySelectorAll(".scroll > *").forEach((wide) => { wide.style.zoom = ""; });
    folded.forEach((fold) => { fold.open = false; });
  });
});

// The player of the motion loads when seen.
const player = document.getElementById("player");
function play([entry], watching) {
  if (!entry.isIntersecting) return;
  entry.target.srcdoc = player.textContent.replace(/<\\(?=\\*(?:!--|\/?script))/gi, "<");
  watching.disconnect();
}
if (player) new IntersectionObserver(play, { rootMargin: "400px" }).observe(player.previousElementSibling);

const nav = document.querySelector("nav");
for (const heading of document.querySelectorAll("section > h2")) {
  const link = document.createElement("a");
  link.href = "#" + heading.parentElement.id;
  link.textContent = heading.textContent;
  nav.append(link);
}
