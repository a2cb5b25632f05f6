// viser's client takes one file from a choice. Several are given to it one after another, and files
// that are dropped on the page go to the upload button that is shown.
(() => {
  if (window.fxFiles) return;
  window.fxFiles = true;
  const NEXT = 300;  // ms: one transfer begins before the next file is chosen
  const MOST = 50;

  const give = (input, file) => {
    const one = new DataTransfer();
    one.items.add(file);
    input.files = one.files;
    input.dispatchEvent(new Event("change", {bubbles: true}));
  };
  const giveAll = (input, files) => [...files].slice(0, MOST)
    .forEach((file, k) => setTimeout(() => give(input, file), k * NEXT));

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
  const target = () => document.querySelector('input[type="file"]');
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
