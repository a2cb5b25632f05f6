// What all Plotly figures of the page share: a figure to copy or save, one time axis, and a picture
// that moves from what it was to what it is where its layout asks for it (meta.morph).
(() => {
  if (window.fxPlots) return;
  window.fxPlots = true;
  const MORPH = 1600;  // ms
  const calm = matchMedia("(prefers-reduced-motion: reduce)");

  // Figures leave the page with a white ground, as a paper has it.
  const plain = node => ({
    data: node.data,
    layout: {...node.layout, paper_bgcolor: "#fff", width: node.clientWidth, height: node.clientHeight},
  });
  const copy = async node => {
    const address = await window.Plotly.toImage(plain(node), {format: "png", scale: 3});
    try {
      const blob = await (await fetch(address)).blob();
      await navigator.clipboard.write([new ClipboardItem({"image/png": blob})]);
    } catch (error) {
      save(address, "png");  // no clipboard without https or the right to it
    }
  };
  const save = (address, ending) => {
    const link = document.createElement("a");
    link.href = address;
    link.download = `figure.${ending}`;
    link.click();
  };
  const ICON = (path) => ({width: 24, height: 24, path});
  const BUTTONS = [[
    {name: "png", title: "Copy as PNG", click: copy,
     icon: ICON("M8 4h10v14H8zM4 8v14h12v-2H6V8z")},
    {name: "svg", title: "Save as SVG", icon: ICON("M11 3h2v9h4l-5 6-5-6h4zM4 20h16v2H4z"),
     click: async node => save(await window.Plotly.toImage(plain(node), {format: "svg"}), "svg")},
    {name: "reset", title: "Reset the zoom", icon: ICON("M12 5a7 7 0 1 1-6.3 4h2.3a5 5 0 1 0 4-2v3L7.5 6 12 2z"),
     click: node => window.Plotly.relayout(node, reset(node))},
  ]];
  // Any figure opens large in the middle; Escape or a click beside it closes it.
  const large = document.createElement("dialog");
  large.id = "fx-large";
  large.innerHTML = "<button type='button' aria-label='Close' title='Close'>✕</button><div></div>";
  const sheet = large.querySelector("div");
  large.querySelector("button").onclick = () => large.close();
  large.onclick = event => { if (event.target === large) large.close(); };
  large.onclose = () => window.Plotly.purge(sheet);
  document.body.append(large);
  const enlarge = node => {
    large.showModal();
    const legend = {font: {size: 13}}, {width, height, ...layout} = node.layout;
    window.Plotly.newPlot(sheet, node.data, {
      ...layout, autosize: true, font: {...layout.font, size: 14}, legend: {...layout.legend, ...legend},
      margin: {...layout.margin, l: 90, b: 60},
    }, {responsive: true, displaylogo: false, displayModeBar: "hover", modeBarButtons: BUTTONS});
  };
  const offer = node => {
    if (node === sheet || node.parentElement.querySelector(":scope > .fx-enlarge")) return;
    const button = document.createElement("button");
    button.type = "button";
    button.className = "fx-enlarge";
    button.title = "Open large";
    button.setAttribute("aria-label", "Open large");
    button.textContent = "⤢";
    button.onclick = () => enlarge(node);
    node.parentElement.append(button);
  };
  const axes = node => Object.keys(node.layout ?? {}).filter(key => /^[xy]axis\d*$/.test(key));
  const reset = node => Object.fromEntries(axes(node).flatMap(key => {
    const was = node.fxRanges?.[key];
    return was ? [[`${key}.range`, [...was]]] : [[`${key}.autorange`, true]];
  }));

  // One time axis: where one figure is zoomed, all others over time follow.
  let following = false;
  const timed = node => /^time \[/.test(node.layout?.xaxis?.title?.text ?? "") ? "xaxis" : null;
  const follow = (node, change) => {
    const own = timed(node);
    if (following || !own) return;
    const range = change["xaxis.range"] ?? (change["xaxis.range[0]"] === undefined ? null
      : [change["xaxis.range[0]"], change["xaxis.range[1]"]]);
    if (!range && !change["xaxis.autorange"]) return;
    following = true;
    const unit = node.layout.xaxis.title.text;
    const others = [...document.querySelectorAll(".js-plotly-plot")].filter(
      other => other !== node && timed(other) && other.layout.xaxis.title.text === unit);
    Promise.all(others.map(other => window.Plotly.relayout(
      other, range ? {"xaxis.range": [...range]} : {"xaxis.autorange": true})))
      .finally(() => { following = false; });
  };

  // The time-line's cursor: only its line moves, and stays where it is told when a figure is drawn
  // again. The key changes with every figure that is sent.
  const cursors = {};
  const place = node => {
    const time = cursors[node.layout?.meta?.cursor], axis = node._fullLayout?.xaxis;
    const k = (node.layout?.shapes ?? []).findIndex(shape => shape.name === "cursor");
    const line = node.querySelector(`.shapelayer path[data-index="${k}"]`);
    if (time === undefined || !axis || !line) return;
    // Figures that are copied or drawn again have it there; where this one was drawn, its line knows.
    const shape = node.layout.shapes[k], at = axis.l2p(time);
    line.fxAt ??= shape.x0;
    shape.x0 = shape.x1 = time;
    line.style.display = at < 0 || at > axis._length ? "none" : "";
    line.setAttribute("transform", `translate(${at - axis.l2p(line.fxAt)}, 0)`);
  };
  window.fxCursor = (key, time) => {
    cursors[key] = time;
    for (const node of document.querySelectorAll(".js-plotly-plot"))
      if (node.layout?.meta?.cursor === key) place(node);
  };

  const numbers = values => {
    if (!values?.bdata) return values;
    const bytes = Uint8Array.from(atob(values.bdata), letter => letter.charCodeAt(0));
    return values.dtype === "i4" ? new Int32Array(bytes.buffer) : new Float32Array(bytes.buffer);
  };
  const wrap = () => {
    const drawn = window.Plotly.react;
    window.Plotly.react = (node, data, layout, config) => {
      const moves = layout?.meta?.morph && !calm.matches && node._fullData?.length;
      const was = moves ? node._fullData.map(trace => Array.from(trace.y ?? [])) : [];
      const names = moves ? node._fullData.map(trace => trace.name) : [];
      const shared = {...config, displaylogo: false, displayModeBar: "hover", modeBarButtons: BUTTONS};
      const keep = () => {
        offer(node);
        node.fxRanges = Object.fromEntries(Object.entries(layout ?? {})
          .filter(([key, axis]) => /^[xy]axis\d*$/.test(key) && axis.range)
          .map(([key, axis]) => [key, [...axis.range]]));
        if (!node.fxLinked && node.on) {
          node.fxLinked = true;
          node.on("plotly_relayout", change => follow(node, change));
          node.on("plotly_afterplot", () => place(node));
        }
      };
      cancelAnimationFrame(node.fxFrame);
      const is = moves ? data.map(trace => numbers(trace.y) ?? []) : [];
      // Only curves that were there before move: a law that is new appears at once.
      const pairs = is.map((y, k) => {
        const at = names[k] === data[k].name ? k : names.indexOf(data[k].name);
        return at >= 0 && was[at].length === y.length ? was[at] : null;
      });
      const any = pairs.some((old, k) => old && old.some((v, i) => v !== is[k][i]));
      if (!moves || !any) {
        const made = drawn(node, data, layout, shared);
        keep();
        return made;
      }
      const began = performance.now();
      const frame = now => {
        const share = Math.min((now - began) / MORPH, 1);
        const eased = share * share * (3 - 2 * share);
        const between = data.map((trace, k) => !pairs[k] || share === 1 ? trace : {
          ...trace, y: pairs[k].map((y, i) => y + eased * (is[k][i] - y)),
        });
        drawn(node, between, layout, shared);
        if (share < 1 && node.isConnected) node.fxFrame = requestAnimationFrame(frame);
      };
      frame(began);
      keep();
      return Promise.resolve(node);
    };
  };
  const wait = setInterval(() => {
    if (!window.Plotly?.react) return;
    clearInterval(wait);
    wrap();
  }, 20);
})();
