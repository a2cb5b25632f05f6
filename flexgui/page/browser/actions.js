// What is pressed in the page's own HTML, for the server (page/actions.py); the stage in the address.
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

  // viser keeps one message back for 50 ms, the newest of all inputs: a click would replace what was
  // typed just before, which then never arrives. Twice that and a little more is waited for.
  let typed = -1e9;
  const rest = () => typed + 120 - performance.now();
  document.addEventListener("input", event => {
    if (event.target !== field() && !event.target.closest("#fx-line")) typed = performance.now();
  }, true);
  document.addEventListener("click", event => {
    const button = event.target.closest("button:not([data-action])"), wait = rest();
    if (!button || wait <= 0) return;
    event.stopPropagation();
    event.preventDefault();
    setTimeout(() => button.click(), wait);
  }, true);
  window.fxAct = (action, value = "") => setTimeout(() => send(action, value), Math.max(rest(), 0));

  // A row may be drawn anew between a finger's coming and going: where it comes and goes counts.
  const keyed = target => target?.closest?.("button[data-action]:not([disabled])");
  const key = button => button && `${button.dataset.action}\n${button.dataset.value ?? ""}`;
  const act = button => window.fxAct(button.dataset.action, button.dataset.value);
  let down = null, focused = null;
  document.addEventListener("pointerdown", event => { down = key(keyed(event.target)); }, true);
  document.addEventListener("pointerup", event => {
    const button = keyed(event.target);
    if (button && key(button) === down) act(button);
    down = null;
  }, true);
  document.addEventListener("click", event => {  // by a key, or by an aid that presses for a person
    const button = keyed(event.target);
    if (button && event.detail === 0) act(button);
  }, true);
  document.addEventListener("change", event => {
    if (event.target.matches?.("select[data-action]"))
      window.fxAct(event.target.dataset.action, event.target.value);
  }, true);
  document.addEventListener("focusin", ({target}) => {  // a mouse leaves the keys to the time-line
    focused = target.matches(":focus-visible") ? key(keyed(target)) : null;
  });
  const refocus = () => {
    if (!focused || document.activeElement !== document.body) return;
    [...document.querySelectorAll("button[data-action]")].find(b => key(b) === focused)
      ?.focus({preventScroll: true});
  };

  // The stage stands in the address, and the browser's Back leads to the one before.
  const shown = () => document.querySelector(".fx .steps [aria-current]")?.dataset.value;
  const wanted = () => new URLSearchParams(location.search).get("stage") ?? "";
  const known = name => [...document.querySelectorAll(".fx .steps button")]
    .find(b => b.dataset.value.toLowerCase() === name.toLowerCase())?.dataset.value;
  let before = null;
  const follow = () => {
    const now = shown(), there = known(wanted());
    if (!now || now === before) return;
    const first = before === null;
    before = now;
    if (first && there && there !== now) return window.fxAct("stage", there);
    if (there === now) return;
    const address = new URL(location.href);  // no fragment: viser makes its socket's address of this
    address.searchParams.set("stage", now.toLowerCase());
    history[first ? "replaceState" : "pushState"](null, "", address);
  };
  addEventListener("popstate", () => {
    const there = known(wanted());
    if (there && there !== shown()) window.fxAct("stage", there);
  });

  // What was unfolded stays so when it is drawn anew.
  const unfolded = new Set();
  document.addEventListener("toggle", ({target}) => {
    if (target.dataset?.fold) unfolded[target.open ? "add" : "delete"](target.dataset.fold);
  }, true);
  const unfold = () => document.querySelectorAll("details[data-fold]:not([open])").forEach(fold => {
    fold.open = unfolded.has(fold.dataset.fold);
  });

  let asked = 0;
  const soon = () => {
    asked ||= setTimeout(() => { asked = 0; refocus(); unfold(); follow(); }, 30);
  };
  new MutationObserver(soon).observe(document.body, {childList: true, subtree: true});
  soon();
})();
