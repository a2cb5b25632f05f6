// Adds to viser's client: names for screen readers, keys for scrolling areas. Runs once per window.
(() => {
  if (window.fxPage) return;
  window.fxPage = true;

  // Settings that only this browser stores.
  const stored = name => localStorage.getItem(`viser-user:flexgui-${name}`);
  const applySettings = () => {
    document.documentElement.style.fontSize = `${Number(stored("text")) || 100}%`;
    for (const select of document.querySelectorAll(".fx select[data-kept]"))
      select.value = stored(select.dataset.kept) ?? select.options[0].value;
  };
  document.addEventListener("change", event => {
    const name = event.target.dataset?.kept;
    if (!name) return;
    localStorage.setItem(`viser-user:flexgui-${name}`, event.target.value);
    if (name === "look") location.reload();
    applySettings();
  }, true);

  // Names: viser's sliders, their boxes and its icons have none.
  const labelOf = id => id && document.querySelector(`label[for="${CSS.escape(id)}"]`)?.innerText;
  const name = (element, text) => {
    if (element && text && element.getAttribute("aria-label") !== text)
      element.setAttribute("aria-label", text);
  };
  // uPlot's legend knows squares only: the mark before a name becomes the line or dot that is drawn.
  const MARKS = {"━": "solid", "╍": "dashed", "┉": "dotted", "•": "dots"};
  const markLegends = () => {
    for (const label of document.querySelectorAll(".u-label")) {
      const mark = MARKS[label.textContent[0]];
      if (!mark) continue;
      label.closest(".u-series").dataset.mark = mark;
      label.textContent = label.textContent.slice(1).trim();
    }
  };
  const nameAll = () => {
    for (const slider of document.querySelectorAll(".mantine-Slider-root")) {
      const text = labelOf(slider.id);
      name(slider.querySelector('[role="slider"]'), text);
      name(slider.parentElement.querySelector("input.mantine-NumberInput-input"), text);
    }
    for (const input of document.querySelectorAll("input:not([type=hidden])")) {
      if (input.labels?.length || input.getAttribute("aria-label")) continue;
      const row = input.closest("div:has(> div label)") ?? input.closest("div:has(label)");
      name(input, row?.querySelector("label")?.innerText || "value");
    }
    for (const button of document.querySelectorAll("button")) {
      if (button.textContent.trim() || button.getAttribute("aria-label")) continue;
      const close = button.className.includes("CloseButton") || button.closest(".mantine-Notification-root");
      name(button, close ? "Close" : button.title || "Settings of the view");
    }
    // A folder's title opens and closes it: by keys too.
    for (const title of document.querySelectorAll(
      '.mantine-Paper-root > .mantine-Paper-root[style*="cursor: pointer"]')) {
      title.setAttribute("role", "button");
      title.tabIndex = 0;
      const open = title.querySelector(".tabler-icon-chevron-up");
      title.setAttribute("aria-expanded", String(Boolean(open)));
    }
    // viser's pictures are decoration: the text is beside them.
    for (const image of document.querySelectorAll("img:not([alt])")) image.alt = "";
    // The page draws without reflections there by itself: close viser's warning.
    for (const note of document.querySelectorAll(".mantine-Notification-root"))
      if (note.innerText.startsWith("Software WebGL")) note.querySelector("button")?.click();
    for (const shown of document.querySelectorAll("canvas[data-engine]")) {
      shown.setAttribute("role", "img");
      name(shown, "The arm in 3-D; the time-line and the tables say the same in numbers.");
    }
    // Scrolling areas get the focus, so that keys scroll them.
    for (const area of document.querySelectorAll(
      ".mantine-ScrollArea-viewport, .fx .formula, .fx .scroll"))
      if (!area.hasAttribute("tabindex") && (area.scrollHeight > area.clientHeight
          || area.scrollWidth > area.clientWidth)) area.tabIndex = 0;
  };
  document.addEventListener("keydown", event => {
    if ((event.key === "Enter" || event.key === " ") && event.target.matches('div[role="button"][aria-expanded]')) {
      event.preventDefault();
      event.target.click();
    }
  });
  // The box of a slider: what is no number between its ends says so, and the last value stands again.
  const rowOf = box => box.closest?.(".mantine-NumberInput-root")?.parentElement;
  const thumbOf = box => rowOf(box)?.querySelector('[role="slider"]');
  const write = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
  const last = new WeakMap();
  const check = box => {
    const thumb = thumbOf(box);
    if (!thumb || !last.has(box)) return;
    rowOf(box).querySelector(".fx-refused")?.remove();
    const [low, high] = [thumb.ariaValueMin, thumb.ariaValueMax].map(Number);
    const value = box.value.trim() === "" ? NaN : Number(box.value);
    if (value >= low && value <= high) return last.set(box, box.value);
    const note = document.createElement("p");
    note.className = "fx-refused";
    note.setAttribute("role", "alert");
    note.textContent = `${Number.isNaN(value) ? "That" : box.value} is not a number from ${low} to ${high}; still ${last.get(box)}.`;
    rowOf(box).append(note);
    write.call(box, last.get(box));
    box.dispatchEvent(new Event("input", {bubbles: true}));
  };
  document.addEventListener("focusin", ({target}) => thumbOf(target) && last.set(target, target.value));
  document.addEventListener("focusout", ({target}) => check(target), true);
  document.addEventListener("keydown", ({key, target}) => key === "Enter" && check(target), true);
  // On a phone all panels are in one sheet below the arm: a row of links scrolls to each.
  const phone = matchMedia("(max-width: 576px)");
  const sheet = () => document.querySelector('.mantine-Paper-root[style*="position: fixed"]');
  const heading = text => [...(sheet()?.querySelectorAll("*") ?? [])].find(
    e => !e.children.length && e.textContent.trim() === text && !e.closest("button, .fx, svg"));
  const goTo = text => {
    const title = heading(text);
    if (!title) return;
    const row = title.closest('[role="button"]') ?? title.parentElement;
    const next = row.nextElementSibling ?? row.parentElement.nextElementSibling;
    if (!next || !next.checkVisibility() || next.getBoundingClientRect().height < 20) title.click();
    setTimeout(() => title.scrollIntoView({block: "start"}), 350);
  };
  const links = () => {
    const there = document.getElementById("fx-links");
    if (!phone.matches || !sheet()) return there?.remove();
    if (there) return;
    const row = document.createElement("nav");
    row.id = "fx-links";
    row.setAttribute("aria-label", "Parts of the page");
    for (const [text, act] of [
      ["Stages", () => sheet().querySelector(".fx-bar")?.closest(".fx").parentElement.parentElement
        .scrollIntoView({block: "start"})],
      ["Plots", () => goTo("Plots")],
    ]) {
      const link = document.createElement("button");
      link.textContent = text;
      link.onclick = act;
      row.append(link);
    }
    document.body.append(row);
  };
  let scheduled = 0;
  const schedule = () => {
    if (!scheduled) scheduled = setTimeout(() => { scheduled = 0; nameAll(); markLegends(); applySettings(); links(); }, 200);
  };
  new MutationObserver(schedule).observe(document.body, {childList: true, subtree: true});
  schedule();
})();
