// viser's client takes one file of a selection. Several are sent one after another, and files that are
// dropped on the page go to the visible upload button.
(() => {
  if (window.fxFiles) return;
  window.fxFiles = true;
  const LOOK = 300;  // ms between two checks for the note of a transfer
  const SHOWN = 1000;  // ms within which the note of a transfer appears
  const MOST = 50;
  const waiting = [];
  let running = false;
  let lastSent = -Infinity;

  const sendFile = ([button, file]) => {
    const input = button.isConnected ? button : target();
    if (!input) return;
    lastSent = performance.now();
    const transfer = new DataTransfer();
    transfer.items.add(file);
    input.files = transfer.files;
    input.dispatchEvent(new Event("change", {bubbles: true}));
  };
  // A button handles one transfer at a time: with a second one the note of the first would stay.
  const busy = () => performance.now() - lastSent < SHOWN || [...document.querySelectorAll(".mantine-Notification-root")]
    .some(note => note.innerText.trim().startsWith("Uploading"));
  const next = () => {
    if (!busy() && waiting.length) sendFile(waiting.shift());
    running = waiting.length > 0;
    if (running) setTimeout(next, LOOK);
  };
  const sendAll = (input, files) => {
    waiting.push(...[...files].slice(0, MOST).map(file => [input, file]));
    if (!running) { running = true; next(); }
  };

  document.addEventListener("change", event => {
    const input = event.target;
    if (input.type !== "file" || !input.files || input.files.length < 2) return;
    event.stopImmediatePropagation();
    sendAll(input, [...input.files]);
  }, true);

  const allowMultiple = () => {
    for (const input of document.querySelectorAll('input[type="file"]')) input.multiple = true;
  };
  new MutationObserver(allowMultiple).observe(document.body, {childList: true, subtree: true});
  allowMultiple();

  const holdsFiles = event => [...(event.dataTransfer?.types ?? [])].includes("Files");
  const target = () => [...document.querySelectorAll('input[type="file"]')]
    .find(input => input.parentElement.offsetParent);
  document.addEventListener("dragover", event => {
    if (holdsFiles(event) && target()) event.preventDefault();
  });
  document.addEventListener("drop", event => {
    if (!holdsFiles(event)) return;
    event.preventDefault();
    const input = target();
    if (input) sendAll(input, event.dataTransfer.files);
  });
})();
