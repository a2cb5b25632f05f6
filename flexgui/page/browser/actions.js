// Sends presses in the page's own HTML to the server (page/actions.py); puts the stage in the address.
(() => {
  if (window.fxAct) return;
  let number = Date.now();
  const field = () => document.querySelector(".fx-actions")?.closest(".fx").parentElement
    .nextElementSibling?.querySelector("input");
  const write = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
  const send = (action, value) => {
    const input = field();
    if (!input || document.querySelector(".fx .follows")) return;
    number += 1;
    write.call(input, JSON.stringify([number, action, String(value)]));
    input.dispatchEvent(new Event("input", {bubbles: true}));
  };

  // viser delays the newest message of all inputs for 50 ms: a click would replace a text that was
  // typed just before. So a click waits 120 ms after typing.
  let typed = -1e9;
  const delayAfterTyping = () => typed + 120 - performance.now();
  document.addEventListener("input", event => {
    if (event.target !== field() && !event.target.closest("#fx-line")) typed = performance.now();
  }, true);
  document.addEventListener("click", event => {
    const button = event.target.closest("button:not([data-action])"), wait = delayAfterTyping();
    if (!button || wait <= 0) return;
    event.stopPropagation();
    event.preventDefault();
    setTimeout(() => button.click(), wait);
  }, true);
  window.fxAct = (action, value = "") => setTimeout(() => send(action, value), Math.max(delayAfterTyping(), 0));

  // A row may be redrawn between press and release: compare the buttons' keys, not the elements.
  const buttonAt = target => target?.closest?.("button[data-action]:not([disabled])");
  const key = button => button && `${button.dataset.action}\n${button.dataset.value ?? ""}`;
  // A button in a sheet sends all fields of the sheet. What is typed there survives that it is redrawn.
  const typedFields = new Map();
  const fieldsOf = sheet => Object.fromEntries(
    [...sheet.querySelectorAll("input[name]")].map(input => [input.name, input.value]));
  const act = button => {
    const sheet = button.closest(".sheet");
    window.fxAct(button.dataset.action, sheet ? JSON.stringify(fieldsOf(sheet)) : button.dataset.value);
    if (sheet) typedFields.clear();
  };
  document.addEventListener("input", ({target}) => {
    if (target.matches?.(".sheet input[name]")) typedFields.set(target.name, target.value);
  });
  document.addEventListener("keydown", event => {
    if (event.key !== "Enter" || !event.target.matches?.(".sheet input[name]")) return;
    event.preventDefault();
    act(event.target.closest(".sheet").querySelector("button[data-action]"));
  });
  let edited = null;
  const restoreFields = () => {
    for (const input of document.querySelectorAll(".sheet input[name]"))
      if (typedFields.has(input.name) && input.value !== typedFields.get(input.name))
        input.value = typedFields.get(input.name);
    if (!edited || document.activeElement !== document.body) return;
    document.querySelector(`.sheet input[name="${CSS.escape(edited)}"]`)?.focus({preventScroll: true});
  };
  let down = null, focused = null;
  document.addEventListener("pointerdown", event => { down = key(buttonAt(event.target)); }, true);
  document.addEventListener("pointerup", event => {
    const button = buttonAt(event.target);
    if (button && key(button) === down) act(button);
    down = null;
  }, true);
  document.addEventListener("click", event => {  // by a key or by assistive software
    const button = buttonAt(event.target);
    if (button && event.detail === 0) act(button);
  }, true);
  document.addEventListener("change", event => {
    if (event.target.matches?.("select[data-action]"))
      window.fxAct(event.target.dataset.action, event.target.value);
  }, true);
  document.addEventListener("focusin", ({target}) => {  // a mouse leaves the keys to the time-line
    focused = target.matches(":focus-visible") ? key(buttonAt(target)) : null;
    edited = target.matches(".sheet input[name]") ? target.name : null;
  });
  const refocus = () => {
    if (!focused || document.activeElement !== document.body) return;
    [...document.querySelectorAll("button[data-action]")].find(b => key(b) === focused)
      ?.focus({preventScroll: true});
  };

  // The address holds the stage, so the browser's Back shows the stage before.
  const shown = () => document.querySelector(".fx .steps [aria-current]")?.dataset.value;
  const wanted = () => new URLSearchParams(location.search).get("stage") ?? "";
  const stageNamed = name => [...document.querySelectorAll(".fx .steps button")]
    .find(b => b.dataset.value.toLowerCase() === name.toLowerCase())?.dataset.value;
  let before = null;
  const follow = () => {
    const now = shown(), target = stageNamed(wanted());
    if (!now || now === before) return;
    const first = before === null;
    before = now;
    if (first && target && target !== now) return window.fxAct("stage", target);
    if (target === now) return;
    const address = new URL(location.href);  // no fragment: viser makes its socket's address of this
    address.searchParams.set("stage", now.toLowerCase());
    history[first ? "replaceState" : "pushState"](null, "", address);
  };
  addEventListener("popstate", () => {
    const target = stageNamed(wanted());
    if (target && target !== shown()) window.fxAct("stage", target);
  });

  // Unfolded parts stay unfolded when they are redrawn.
  const unfolded = new Set();
  document.addEventListener("toggle", ({target}) => {
    if (target.dataset?.fold) unfolded[target.open ? "add" : "delete"](target.dataset.fold);
  }, true);
  const unfold = () => document.querySelectorAll("details[data-fold]:not([open])").forEach(fold => {
    fold.open = unfolded.has(fold.dataset.fold);
  });

  let scheduled = 0;
  const schedule = () => {
    scheduled ||= setTimeout(() => { scheduled = 0; refocus(); unfold(); follow(); }, 30);
  };
  // What was typed is there again before anything is painted.
  new MutationObserver(() => { restoreFields(); schedule(); }).observe(document.body, {childList: true, subtree: true});
  schedule();
})();
