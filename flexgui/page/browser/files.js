// viser's client takes one file from a choice. Several are given to it one after another, and files
// that are dropped on the page go to the upload button that is shown.
(() => {
  if (window.fxFiles) return;
  window.fxFiles = true;
  const LOOK = 300;  // ms between two looks at the note of a transfer
  const SHOWN = 1000;  // ms within which the note of a transfer appears
  const MOST = 50;
  const waits = [];
  let going = false;
  let given = -Infinity;

  const give = ([button, file]) => {
    const input = button.isConnected ? button : target();
    if (!input) return;
    given = performance.now();
    const one = new DataTransfer();
    one.items.add(file);
    input.files = one.files;
    input.dispatchEvent(new Event("change", {bubbles: true}));
  };
  // A button's client knows one transfer at a time: a second one would leave the first one's note
  // standing for ever.
  const busy = () => performance.now() - given < SHOWN || [...document.querySelectorAll(".mantine-Notification-root")]
    .some(note => note.innerText.trim().startsWith("Uploading"));
  const next = () => {
    if (!busy() && waits.length) give(waits.shift());
    going = waits.length > 0;
    if (going) setTimeout(next, LOOK);
  };
  const giveAll = (input, files) => {
    waits.push(...[...files].slice(0, MOST).map(file => [input, file]));
    if (!going) { going = true; next(); }
  };

  document.addEventListener("change", event => {
    const input = event.target;
    if (input.type !== "file" || !input.files || input.files.length < 2) return;
    event.stopImmediatePropagation();
    giveAll(input, [...input.files]);
  }, true);

  const several = () => {
    for (const input of document.querySelectorAll('input[type="file"]')) input.multiple = true;
  };
  new MutationObserver(several).observe(document.body, {childList: true, subtree: true});
  several();

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
    if (input) giveAll(input, event.dataTransfer.files);
  });
})();
