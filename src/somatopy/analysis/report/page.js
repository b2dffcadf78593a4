"use strict";
(() => {
  const CONFIG = {
    responsive: true,
    displaylogo: false,
    showSendToCloud: false, // plotly would offer to upload the data
    plotlyServerURL: "",
    modeBarButtons: [["toImage", "zoom2d", "pan2d", "resetScale2d"]],
  };
  const plot = (data) => {
    const { data: traces, layout } = JSON.parse(data.textContent);
    document.getElementById(data.dataset.plot).style.minHeight = `${layout.height}px`; // kept while it is redrawn
    Plotly.newPlot(data.dataset.plot, traces, layout, CONFIG);
  };
  for (const data of document.querySelectorAll("script[data-plot]")) if (!data.closest("details.more")) plot(data);
  /* What is folded is drawn when it is opened: it has no size before. */
  for (const details of document.querySelectorAll("details.more")) {
    const unfold = () => details.open && details.querySelectorAll("script[data-plot]").forEach(plot);
    details.addEventListener("toggle", unfold, { once: true });
  }
  const resize = () => document.querySelectorAll(".js-plotly-plot").forEach((plot) => Plotly.Plots.resize(plot));
  addEventListener("beforeprint", resize);
  addEventListener("afterprint", resize);

  const packed = document.getElementById("maps-data");
  if (packed) explore(JSON.parse(packed.textContent));

  /* Both maps side by side in one plane, each in a box of its own: arm at x 0 to 1, head at x 1.5 to 2.5. */
  function explore(maps) {
    const SHIFT = 1.5;
    const slider = document.getElementById("maps-window");
    const when = document.getElementById("maps-when");
    const view = document.getElementById("maps-view");
    const windows = maps.windows.map((w) => ({
      ...w,
      arm: shown("arm", unpack(w.arm)),
      head: shown("head", unpack(w.head)),
      leads: unpack(w.leads),
      pre: unpack(w.pre),
      strength: unpack(w.strength),
    }));
    const ranges = { arm: spans("arm"), head: spans("head") };

    slider.max = windows.length - 1;
    slider.value = windows.length - 1;
    view.add(new Option("lattice space", "lattice"));
    maps.arm.pairs.forEach(([a, b], k) => {
      view.add(new Option(`joint space: ${[...new Set([a, b])].map((j) => maps.arm.joints[j]).join(", ")}`, String(k)));
    });
    slider.addEventListener("input", draw);
    view.addEventListener("change", draw);
    draw();

    function unpack(text) {
      const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
      const view = new DataView(bytes.buffer);
      return Array.from({ length: bytes.length / 2 }, (_, k) => view.getInt16(2 * k, true));
    }
    /* Degrees or metres, joint after joint. */
    function shown(side, values) {
      const { steps } = maps[side];
      return values.map((value, k) => value / steps[k % steps.length]);
    }
    /* The least and the greatest value of each joint over all windows. */
    function spans(side) {
      const n = maps[side].joints.length;
      return Array.from({ length: n }, (_, j) => {
        let [low, high] = [Infinity, -Infinity];
        for (const w of windows)
          for (let k = j; k < w[side].length; k += n) {
            low = Math.min(low, w[side][k]);
            high = Math.max(high, w[side][k]);
          }
        return high > low ? [low, high] : [low - 1, low + 1];
      });
    }
    function place(w, side, pair) {
      const [rows, columns] = maps[side].shape;
      const n = maps[side].joints.length;
      const shift = side === "head" ? SHIFT : 0;
      const at = (k, j) => (w[side][k * n + j] - ranges[side][j][0]) / (ranges[side][j][1] - ranges[side][j][0]);
      const across = (k) => (k % columns) / Math.max(columns - 1, 1);
      const up = (k) => Math.floor(k / columns) / Math.max(rows - 1, 1);
      const row = rows > 1 ? up : across;
      const spot = (k) =>
        pair
          ? [shift + at(k, pair[0]), pair[0] === pair[1] ? row(k) : at(k, pair[1])]
          : [shift + across(k), up(k)];
      return Array.from({ length: rows * columns }, (_, k) => spot(k));
    }
    function edges(spots, [rows, columns]) {
      const x = [], y = [];
      const walk = (outer, inner, index) => {
        for (let a = 0; a < outer; a++) {
          for (let b = 0; b < inner; b++) {
            const [u, v] = spots[index(a, b)];
            x.push(u), y.push(v);
          }
          x.push(null), y.push(null);
        }
      };
      walk(rows, columns, (a, b) => a * columns + b);
      walk(columns, rows, (a, b) => b * columns + a);
      return { x, y, mode: "lines", line: { color: "rgba(127,127,127,.35)", width: 0.6 }, hoverinfo: "skip" };
    }
    function links(w, arm, head) {
      return [[0, 333, 0.5], [333, 667, 1.1], [667, 1001, 2]].map(([low, high, width]) => {
        const x = [], y = [];
        w.pre.forEach((unit, k) => {
          if (w.strength[k] >= low && w.strength[k] < high) {
            const [a, b] = [arm[unit], head[w.leads[unit]]];
            x.push(a[0], b[0], null), y.push(a[1], b[1], null);
          }
        });
        return { x, y, mode: "lines", line: { color: "rgba(34,34,34,.45)", width }, hoverinfo: "skip" };
      });
    }
    function units(spots, chosen, colors, text, hollow) {
      return {
        x: chosen.map((k) => spots[k][0]),
        y: chosen.map((k) => spots[k][1]),
        mode: "markers",
        text: chosen.map(text),
        hovertemplate: "%{text}<extra></extra>",
        marker: hollow
          ? { size: 4, color: "white", line: { color: "#9a9a9a", width: 0.8 } }
          : { size: 7, color: chosen.map(colors), coloraxis: "coloraxis", line: { color: "#555", width: 0.4 } },
      };
    }
    function posture(w, side, k) {
      const n = maps[side].joints.length;
      return maps[side].joints.map((name, j) => `${name} ${written(side, j, w[side][k * n + j])}`).join(", ");
    }
    function written(side, joint, value) {
      const sign = maps[side].signs[joint];
      return `${value.toFixed(maps[side].decimals[joint])}${sign === "°" ? "" : " "}${sign}`;
    }
    function ticks(side, joint, shift) {
      const [low, high] = ranges[side][joint];
      const fine = maps[side].signs[joint] === "°" ? [1, 2] : [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2];
      const step = [...fine, 5, 10, 20, 50, 100].find((s) => (high - low) / s <= 5) || 200;
      const values = [];
      for (let k = Math.ceil(low / step); k * step <= high; k++) values.push(k * step);
      return {
        tickvals: values.map((v) => shift + (v - low) / (high - low)),
        ticktext: values.map((v) => written(side, joint, v)),
      };
    }
    /* A single joint is drawn over the rows of its lattice, which have no ticks. */
    function upTicks(side, [a, b]) {
      return a === b ? { tickvals: [] } : ticks(side, b, 0);
    }
    function axes(pair) {
      const base = { showgrid: false, showline: Boolean(pair), zeroline: false, fixedrange: true, linecolor: "#222" };
      const names = (side, [a, b]) =>
        `${maps[side].joints[a]} (across), ${a === b ? "row in the lattice" : maps[side].joints[b]} (up)`;
      const [armText, headText] = pair
        ? [`arm map: ${names("arm", pair)}`, `head map: ${names("head", maps.head.pairs[0])}`]
        : [`arm map, ${maps.arm.shape.join(" × ")} units`, `head map, ${maps.head.shape.join(" × ")} units`];
      const note = { yref: "paper", y: 1.02, yanchor: "bottom", showarrow: false, font: { size: 13 } };
      const layout = {
        xaxis: { ...base, range: [-0.05, SHIFT + 1.05], showticklabels: Boolean(pair) },
        yaxis: { ...base, range: [-0.05, 1.05], showticklabels: Boolean(pair), automargin: Boolean(pair) },
        yaxis2: { ...base, range: [-0.05, 1.05], overlaying: "y", side: "right", showticklabels: Boolean(pair) },
        annotations: [{ ...note, x: 0.5, text: armText }, { ...note, x: SHIFT + 0.5, text: headText }],
      };
      if (pair) {
        const [left, right] = [ticks("arm", pair[0], 0), ticks("head", maps.head.pairs[0][0], SHIFT)];
        layout.xaxis.tickvals = [...left.tickvals, ...right.tickvals];
        layout.xaxis.ticktext = [...left.ticktext, ...right.ticktext];
        Object.assign(layout.yaxis, upTicks("arm", pair));
        Object.assign(layout.yaxis2, upTicks("head", maps.head.pairs[0]));
      }
      return layout;
    }
    function draw() {
      const w = windows[slider.value];
      const pair = view.value === "lattice" ? null : maps.arm.pairs[Number(view.value)];
      const arm = place(w, "arm", pair);
      const head = place(w, "head", pair && maps.head.pairs[0]);
      const heads = maps.head.joints.length;
      const yaw = (k) => w.head[k * heads];
      const every = (spots) => spots.map((_, k) => k);
      const linked = every(arm).filter((k) => w.leads[k] >= 0);
      const alone = every(arm).filter((k) => w.leads[k] < 0);
      const traces = [
        edges(arm, maps.arm.shape),
        edges(head, maps.head.shape),
        units(arm, alone, null, (k) => `${posture(w, "arm", k)}<br>no link yet`, true),
        units(arm, linked, (k) => yaw(w.leads[k]), (k) =>
          `${posture(w, "arm", k)}<br>looks to ${posture(w, "head", w.leads[k])}`),
        { ...units(head, every(head), yaw, (k) => posture(w, "head", k)), yaxis: "y2" },
        ...links(w, arm, head),
      ];
      when.textContent =
        `after ${w.minutes} min: ${w.links.toLocaleString("en")} links, ` +
        `from ${w.linked} of ${arm.length} arm units`;
      const layout = {
        ...axes(pair),
        height: 470,
        margin: { l: 48, r: 84, t: 34, b: 34 },
        showlegend: false,
        hovermode: "closest",
        font: { family: "system-ui, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif", size: 12, color: "#222" },
        coloraxis: {
          colorscale: "Cividis", cmin: maps.yaw[0], cmax: maps.yaw[1],
          colorbar: { title: { text: `${maps.head.joints[0]} (${maps.head.signs[0]})`, side: "top" }, thickness: 12, x: 1.06 },
        },
      };
      Plotly.react("plot-maps", traces, layout, { ...CONFIG, modeBarButtons: [["toImage"]] });
    }
  }
})();
