// The bar below the arm (play, time, speed, views) and the key of colours, both over the 3-D picture.
// The server sends their state (page/timeline.py).
(() => {
  if (window.fxLine) return;
  const bar = document.createElement("div"), note = document.createElement("div");
  bar.id = "fx-line";
  bar.setAttribute("role", "group");
  bar.setAttribute("aria-label", "Time-line");
  bar.innerHTML = `
    <button class="play" type="button"></button>
    <input type="range" min="0" step="0.01" aria-label="Time">
    <output></output>
    <select class="speed" aria-label="Speed" title="Speed"></select>
    <select class="apart" aria-label="Error drawn"
      title="Draws the measured arm farther from the model"></select>
    <span class="views" role="group" aria-label="View"></span>`;
  note.id = "fx-key";
  bar.hidden = note.hidden = true;
  const $ = selector => bar.querySelector(selector);
  const play = $(".play"), time = $("input"), read = $("output");
  const ICONS = {  // 24 x 24
    Play: "M7 4v16l13-8z", Pause: "M6 4h4v16H6zM14 4h4v16h-4z",
    Home: "M12 3 3 11h2v9h5v-6h4v6h5v-9h2z", Top: "M4 4h16v16H4zM7 7v10h10V7z",
    Side: "M3 15h18v3H3zM6 9h3v5H6z",
  };
  const face = (button, name) => {
    button.setAttribute("aria-label", name);
    button.title = name;
    button.innerHTML = `<svg viewBox="0 0 24 24" aria-hidden="true"><path d="${ICONS[name]}"/></svg>`;
  };
  let state = {}, lastDrag = 0;
  const toggle = () => window.fxAct("play");
  const step = by => {
    if (!bar.hidden && state.plays) window.fxAct("step", by);
    return state.plays;
  };
  play.onclick = toggle;
  time.oninput = () => {
    lastDrag = performance.now();
    show();
    window.fxAct("seek", time.value);
  };
  const options = (select, values, chosen, action, long, short) => {
    const word = bar.classList.contains("narrow") ? short : long;
    const text = JSON.stringify([word, values]);
    if (select.dataset.options !== text) {
      select.dataset.options = text;
      select.replaceChildren(...values.map(value => new Option(`${word}×${value}`, value)));
      select.onchange = () => window.fxAct(action, select.value);
    }
    select.value = chosen;
  };
  const show = () => {
    const end = bar.classList.contains("narrow") ? "" : ` / ${state.seconds.toFixed(2)}`;
    read.textContent = `${Number(time.value).toFixed(2)}${end} s`;
  };
  const text = (tag, words, kind = "") => {
    const made = document.createElement(tag);
    made.textContent = words;
    made.className = kind;
    return made;
  };
  window.fxLine = now => {
    state = {...state, ...now};
    bar.hidden = false;
    place();
    bar.classList.toggle("views-only", !state.plays);
    if (state.plays) {
      face(play, state.playing ? "Pause" : "Play");
      time.max = state.seconds;
      if (performance.now() - lastDrag > 600) time.value = state.time;
      show();
      options($(".speed"), state.speeds, state.speed, "speed", "speed ", "");
      options($(".apart"), state.errors, state.error, "apart", "error ", "Δ");
      $(".apart").hidden = !state.measured;
    }
    if (!$(".views").children.length)
      for (const name of state.views) {
        const button = document.createElement("button");
        button.type = "button";
        face(button, name);
        button.onclick = () => window.fxAct("view", name);
        $(".views").append(button);
      }
    for (const each of bar.querySelectorAll("button, input, select"))
      each.disabled = state.follows && !each.closest(".views");
    note.hidden = !state.words.length && !state.effects.length;
    note.replaceChildren(...state.effects.map(words => text("p", words, "effect")),
      ...state.words.map(words => text("p", words)));
    if (state.scale) {
      const scale = text("p", "colour, in noise floors: 1", "scale");
      scale.append(text("i", ""), text("span", state.scale));
      scale.querySelector("i").style.background = `linear-gradient(90deg, ${state.colours})`;
      note.append(scale);
    }
  };

  // Places both over the picture between the panels.
  const place = () => {
    const canvas = document.querySelector("canvas[data-engine]")?.getBoundingClientRect();
    if (!canvas) return;
    const sheet = matchMedia("(max-width: 576px)").matches
      && document.querySelector('.mantine-Paper-root[style*="position: fixed"]')?.getBoundingClientRect();
    const below = innerHeight - (sheet ? sheet.top : canvas.bottom) + 8;
    for (const each of [bar, note]) {
      each.style.left = `${canvas.left + 10}px`;
      each.style.bottom = `${below + (each === note ? (bar.hidden ? 0 : 64) : 0)}px`;
      each.style.maxWidth = `${canvas.width - 20}px`;
    }
    bar.style.width = `${canvas.width - 20}px`;
    const narrow = canvas.width < 480, changes = bar.classList.contains("narrow") !== narrow;
    for (const each of [bar, note]) each.classList.toggle("narrow", narrow);
    if (changes && state.views) window.fxLine({});  // its words are shorter now, or longer
  };
  document.body.append(bar, note);
  addEventListener("resize", place);
  setInterval(place, 500);  // a panel's border may have been moved

  // Keys: space plays and pauses, arrows step, wherever no field or button has the focus.
  const BUSY = 'input, textarea, select, button, a, summary, [role="slider"], [role="tab"], '
    + '[role="combobox"], [role="option"], [contenteditable="true"], dialog';
  const KEYS = {" ": () => (toggle(), true), ArrowLeft: () => step(-0.02), ArrowRight: () => step(0.02)};
  document.addEventListener("keydown", event => {
    if (event.ctrlKey || event.metaKey || event.altKey || bar.hidden || !state.plays) return;
    if (event.target.closest?.(BUSY) || document.querySelector('[role="dialog"]')) return;
    if (KEYS[event.key] && KEYS[event.key]()) {
      event.preventDefault();
      event.stopPropagation();
    }
  }, true);
  // A slider's own arrows would turn viser's camera as well.
  document.body.addEventListener("keydown", event => {
    if (event.key.startsWith("Arrow") && event.target.closest('[role="slider"], #fx-line'))
      event.stopPropagation();
  });
})();
