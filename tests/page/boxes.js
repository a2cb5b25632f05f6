// Texts of the page that are cut off, or that stand on one another: [[fault, text, other], ...].
() => {
  const faults = [], seen = [];
  const shown = node => node.checkVisibility({opacityProperty: true, visibilityProperty: true});
  const cut = (rect, node) => {
    // What scrolls is not cut; what hides its overflow is.
    for (let up = node; up && up !== document.body; up = up.parentElement) {
      const style = getComputedStyle(up), box = up.getBoundingClientRect();
      if (style.textOverflow === "ellipsis" && up.scrollWidth > up.clientWidth + 1) return true;
      if (style.position === "fixed") break;
      if (/auto|scroll/.test(style.overflowX)) break;
      if (/hidden|clip/.test(style.overflowX) && box.width > 2
          && (rect.left < box.left - 2 || rect.right > box.right + 2)) return true;
    }
    return false;
  };
  const visible = (rect, node) => {
    for (let up = node; up && up !== document.body; up = up.parentElement) {
      const style = getComputedStyle(up), box = up.getBoundingClientRect();
      if (style.clipPath !== "none" && /inset/.test(style.clipPath)) return false;
      if (style.overflowY !== "visible" && (rect.bottom <= box.top + 1 || rect.top >= box.bottom - 1))
        return false;
      if (style.position === "fixed") break;
    }
    return rect.bottom > 0 && rect.top < innerHeight && rect.right > 0 && rect.left < innerWidth;
  };
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode, parent = node.parentElement;
    if (!node.data.trim() || !parent || parent.closest("script, style, .hoverlayer, math")) continue;
    if (parent.closest("[role=tooltip], .legendtoggle") || !shown(parent)) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    const text = node.data.trim().slice(0, 60);
    const svg = parent.closest("svg.main-svg");
    const layer = parent.closest("[style*='position: fixed'], .mantine-Paper-root");
    // Line by line: the box around two lines of a paragraph also holds what stands beside them.
    for (const rect of range.getClientRects()) {
      if (rect.width < 2 || rect.height < 2 || !visible(rect, parent)) continue;
      if (svg) {
        const box = svg.getBoundingClientRect();
        if (rect.left < box.left - 1 || rect.right > box.right + 1 || rect.top < box.top - 1
            || rect.bottom > box.bottom + 1) faults.push(["cut", text, "figure"]);
      } else if (cut(rect, parent)) {
        faults.push(["cut", text, parent.className.toString().slice(0, 40)]);
      }
      seen.push({text, rect, parent, svg, layer});
    }
  }
  for (let i = 0; i < seen.length; i++) for (let j = i + 1; j < seen.length; j++) {
    const a = seen[i], b = seen[j];
    if (a.parent === b.parent || a.layer !== b.layer || Boolean(a.svg) !== Boolean(b.svg)) continue;
    const wide = Math.min(a.rect.right, b.rect.right) - Math.max(a.rect.left, b.rect.left);
    const high = Math.min(a.rect.bottom, b.rect.bottom) - Math.max(a.rect.top, b.rect.top);
    if (wide <= 2 || high <= 2) continue;
    const least = Math.min(a.rect.width * a.rect.height, b.rect.width * b.rect.height);
    if (wide * high > 0.25 * least) faults.push(["overlap", a.text, b.text]);
  }
  for (const panel of document.querySelectorAll(".mantine-ScrollArea-viewport")) {
    // Tables and equations scroll by themselves; a panel as a whole only up and down.
    if (panel.scrollWidth > panel.clientWidth + 1) faults.push(["sideways", panel.className, ""]);
  }
  return faults;
}
