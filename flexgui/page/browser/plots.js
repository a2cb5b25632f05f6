// For all Plotly figures of the page: copy and save, one common time axis with its cursor, two marks to
// measure between (shift and click), and a transition from the old to the new curves or bars if the layout has meta.morph.
(() => {
  if (window.fxPlots) return;
  window.fxPlots = true;
  const MORPH = 500;  // ms
  const reducedMotion = matchMedia("(prefers-reduced-motion: reduce)");

  // Exported figures have a white background.
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
    for (const event of REDRAWN) sheet.on(event, () => overlay(sheet));
    overlay(sheet);
  };
  const addEnlargeButton = node => {
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

  // If one figure over time is zoomed, all others follow.
  let following = false;
  const figures = () => [...document.querySelectorAll(".js-plotly-plot")];
  const timed = node => {  // what its axis of time is called
    const title = node.layout?.xaxis?.title?.text ?? "";
    return title.startsWith("time [") ? title : "";
  };
  const follow = (node, change) => {
    if (following || !timed(node)) return;
    const range = change["xaxis.range"] ?? (change["xaxis.range[0]"] === undefined ? null
      : [change["xaxis.range[0]"], change["xaxis.range[1]"]]);
    if (!range && !change["xaxis.autorange"]) return;
    following = true;
    const others = figures().filter(other => other !== node && timed(other) === timed(node));
    Promise.all(others.map(other => window.Plotly.relayout(
      other, range ? {"xaxis.range": [...range]} : {"xaxis.autorange": true})))
      .finally(() => { following = false; });
  };

  // The time-line's cursor and the marks A and B, set by clicks, are drawn over the figure, which is not
  // sent again for them. On a map the cursor is a column. A figure's key changes when it is sent.
  const REDRAWN = ["plotly_afterplot", "plotly_relayouting"];
  const cursors = {};
  let marks = {}, measured = null;  // the time of each; the figure that was clicked
  const measurable = node => marks.unit && timed(node) === marks.unit;
  const spans = node => {
    const {cursor, at, columns} = node.layout?.meta ?? {};
    const time = cursor in cursors ? cursors[cursor] : at, found = {};
    if (time != null && timed(node)) found.cursor = [time, time];
    if (time != null && columns) {
      const k = columns.slice(1, -1).filter(edge => edge <= time).length;
      found.cursor = [columns[k], columns[k + 1]];
    }
    if (measurable(node))
      for (const name of "AB") if (name in marks) found[name] = [marks[name], marks[name]];
    return found;
  };
  const overlay = (node, measures = true) => {
    const full = node._fullLayout, axis = full?.xaxis, box = node.querySelector(".svg-container");
    if (!axis || !box) return;
    for (const old of box.querySelectorAll(".fx-at")) old.remove();
    for (const [name, ends] of Object.entries(spans(node))) {
      const [from, to] = ends.map(end => Math.min(Math.max(axis.l2p(end), 0), axis._length));
      if (ends[1] < Math.min(...axis.range) || ends[0] > Math.max(...axis.range)) continue;
      const line = document.createElement("div");
      line.className = `fx-at ${name}${ends[1] > ends[0] ? " column" : ""}`;
      line.dataset.name = name === "cursor" ? "" : name;
      line.style = `left: ${axis._offset + from}px; width: ${to - from}px; `
        + `top: ${full._size.t}px; height: ${full._size.h}px`;
      box.append(line);
    }
    if (!measures) return;
    node.parentElement.querySelector(".fx-measured")?.remove();
    if (!measurable(node)) return;
    if (!measured?.isConnected) measured = node;
    if (node === measured) node.after(difference(node));
  };
  window.fxCursor = (key, time) => {
    cursors[key] = time;
    for (const node of figures()) if (node.layout?.meta?.cursor === key) overlay(node, false);
  };

  const valueAt = (trace, time) => {
    const after = Array.prototype.findIndex.call(trace.x, x => x >= time);
    if (after <= 0) return after === 0 && trace.x[0] === time ? trace.y[0] : NaN;
    const share = (time - trace.x[after - 1]) / (trace.x[after] - trace.x[after - 1]);
    return trace.y[after - 1] + share * (trace.y[after] - trace.y[after - 1]);
  };
  const digits = value => Number.isFinite(value)
    ? String(Number(value.toPrecision(4))).replaceAll("-", "−") : "–";
  const difference = node => {
    const names = [..."AB"].filter(name => name in marks), both = names.length === 2;
    const lines = node._fullData.filter(
      trace => trace.visible === true && trace.name && trace.hoverinfo !== "skip" && trace.x?.length);
    const rows = [[marks.unit, names.map(name => marks[name])], ...lines.map(trace => {
      const axis = node.layout[trace.yaxis.replace("y", "yaxis")];
      const label = `${trace.name}, ${axis?.title?.text ?? ""}`;
      return [label, names.map(name => valueAt(trace, marks[name]))];
    })];
    const table = document.createElement("table");
    table.className = "fx-measured";
    const write = cells => {
      const line = table.insertRow();
      for (const cell of cells) line.insertCell().textContent = cell;
    };
    write(["", ...names, ...(both ? ["B − A"] : [])]);
    for (const [label, values] of rows)
      write([label, ...values.map(digits), ...(both ? [digits(values[1] - values[0])] : [])]);
    const close = document.createElement("button");
    close.type = "button";
    close.textContent = "✕";
    close.title = "Remove A and B (Escape)";
    close.setAttribute("aria-label", close.title);
    close.onclick = () => mark({});
    table.rows[0].cells[0].append(close);
    return table;
  };
  const mark = (found, node = null) => {
    marks = found;
    measured = node;
    for (const each of figures()) overlay(each);
  };
  // A click moves the time-line there. With shift it sets A, then B, then A again.
  document.addEventListener("click", event => {
    const node = event.target.closest?.(".draglayer")?.closest(".js-plotly-plot");
    if (!node || !timed(node) || node.data.some(trace => trace.meta?.cells)) return;
    const axis = node._fullLayout.xaxis, unit = timed(node);
    const time = axis.p2l(event.clientX - node.getBoundingClientRect().left - axis._offset);
    if (!event.shiftKey) {
      const begins = node.layout.meta?.begins;
      if (begins != null && event.detail === 1) window.fxAct("seek", time - begins);
      return;
    }
    const second = marks.unit === unit && "A" in marks && !("B" in marks);
    mark(second ? {...marks, B: time} : {unit, A: time}, node);
  });
  document.addEventListener("dblclick", event => {  // resets the zoom
    if (event.target.closest?.(".js-plotly-plot")) mark({});
  });
  document.addEventListener("keydown", event => {
    if (event.key !== "Escape" || !marks.unit) return;
    event.preventDefault();
    mark({});
  }, true);

  const numbers = values => {
    if (!values?.bdata) return values;
    const bytes = Uint8Array.from(atob(values.bdata), letter => letter.charCodeAt(0));
    return values.dtype === "i4" ? new Int32Array(bytes.buffer) : new Float32Array(bytes.buffer);
  };
  const places = (names, name) => names.flatMap((each, k) => (each === name ? [k] : []));
  // A figure of another size leaves its legend where it was, and one that is resized twice at once may
  // keep the first size: some time after the last size it is drawn again.
  const SETTLED = 300;  // ms
  const settle = (plotly, node, {width, height}) => {
    if (!width || (width === node.fxSize?.width && height === node.fxSize.height)) return;
    node.fxSize = {width, height};
    clearTimeout(node.fxSettle);
    node.fxSettle = setTimeout(() => {
      const is = node.isConnected && node._fullLayout ? node.parentElement.clientWidth : 0;
      if (!is) return;
      Object.assign(node.layout, {width: is, height: height * is / width});
      plotly.redraw(node);
    }, SETTLED);
  };
  const wrap = plotly => {
    const drawn = plotly.react;
    plotly.react = (node, data, layout, config) => {
      settle(plotly, node, layout ?? {});
      const moves = layout?.meta?.morph && !reducedMotion.matches && node._fullData?.length;
      const along = layout?.meta?.morph === "x" ? "x" : "y";
      const was = moves ? node._fullData.map(trace => Array.from(trace[along] ?? [])) : [];
      const names = moves ? node._fullData.map(trace => trace.name) : [];
      const shared = {...config, displaylogo: false, displayModeBar: "hover", modeBarButtons: BUTTONS};
      const keep = () => {
        addEnlargeButton(node);
        node.fxRanges = Object.fromEntries(Object.entries(layout ?? {})
          .filter(([key, axis]) => /^[xy]axis\d*$/.test(key) && axis.range)
          .map(([key, axis]) => [key, [...axis.range]]));
        if (!node.fxLinked && node.on) {
          node.fxLinked = true;
          node.on("plotly_relayout", change => follow(node, change));
          for (const event of REDRAWN) node.on(event, () => overlay(node));
          node.on("plotly_click", ({points: [point]}) => {  // a cell of an error map leads there
            const cells = point?.data.meta?.cells;
            if (cells) window.fxAct("map cell", JSON.stringify([...cells, ...point.pointNumber]));
          });
        }
        overlay(node);
      };
      cancelAnimationFrame(node.fxFrame);
      const is = moves ? data.map(trace => numbers(trace[along]) ?? []) : [];
      // Only curves that existed before move; a new curve appears at once, a new bar falls from the
      // last one of before.
      const pairs = is.map((values, k) => {
        const before = data.slice(0, k).filter(trace => trace.name === data[k].name).length;
        const at = places(names, data[k].name)[before] ?? -1;  // several panes have the same names
        const old = at >= 0 ? was[at] : [];
        if (along === "x" && old.length === values.length - 1 && old.length) return [...old, old.at(-1)];
        if (!old.length || old.length === values.length) return old.length ? old : null;
        // A cloud of a few dots more or less begins at those of about the same time.
        const share = (old.length - 1) / Math.max(values.length - 1, 1);
        return data[k].mode === "markers" ? Array.from(values, (_, i) => old[Math.round(i * share)]) : null;
      });
      const changes = pairs.some((old, k) => old && old.some((v, i) => v !== is[k][i]));
      if (!moves || !changes) {
        const made = drawn(node, data, layout, shared);
        keep();
        return made;
      }
      const began = performance.now();
      const frame = now => {
        const share = Math.min((now - began) / MORPH, 1);
        const eased = share * share * (3 - 2 * share);
        const between = data.map((trace, k) => !pairs[k] || share === 1 ? trace : {
          ...trace, [along]: pairs[k].map((from, i) => from + eased * (is[k][i] - from)),
        });
        drawn(node, between, layout, shared);
        if (share < 1 && node.isConnected) node.fxFrame = requestAnimationFrame(frame);
      };
      frame(began);
      keep();
      return Promise.resolve(node);
    };
  };
  // Plotly is loaded later, and again with each connection.
  let plotly = window.Plotly;
  Object.defineProperty(window, "Plotly", {
    configurable: true,
    get: () => plotly,
    set: made => {
      plotly = made;
      wrap(made);
    },
  });
  if (plotly && !plotly.isWaiting) wrap(plotly);
})();
