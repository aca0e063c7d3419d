// Connects k3d, which shows and plays the scene, with plotly, which draws the curves.
"use strict";
(async () => {
  const $ = (id) => document.getElementById(id);
  const data = JSON.parse($("data").textContent);
  const bytes = (id) => Uint8Array.from(atob($(id).textContent), (c) => c.charCodeAt(0));
  const run = async (id) => {
    const packed = new Blob([bytes(id)]).stream();
    const script = document.createElement("script");
    script.textContent = await new Response(packed.pipeThrough(new DecompressionStream("deflate"))).text();
    document.head.append(script);
  };
  await run("plotly-source");
  let k3d = null;
  window.define = (name, needed, make) => { k3d = make(); };
  await run("k3d-source");
  delete window.define;
  const scene = await k3d.CreateK3DAndLoadBinarySnapshot(bytes("scene-source").buffer, $("scene"));

  // Time: k3d's is the only one.
  const frames = data.frames, start = frames[0], end = frames[frames.length - 1];
  const chosen = new Set(), slider = $("time");
  Object.assign(slider, { min: start, max: end, step: (end - start) / 1000 || 1, value: start });
  let now = start;
  // A line above plotly's curves: one of its own would take 0.1 s to move.
  const margin = { l: 52, r: 12, t: 22, b: 34 };
  const cursor = () => {
    if (!$("curves").layout) return;
    const [low, high] = $("curves").layout.xaxis.range, place = (now - low) / (high - low);
    $("cursor").style.left = margin.l + place * ($("curves").clientWidth - margin.l - margin.r) + "px";
    $("cursor").hidden = place < 0 || place > 1;
  };
  const show = (t) => {
    now = t;
    if (document.activeElement !== slider || scene.autoPlayed) slider.value = t;
    $("now").textContent = t.toFixed(3) + " s";
    cursor();
  };
  scene.on(scene.events.TIME_CHANGE, show);
  slider.addEventListener("input", () => {
    scene.stopAutoPlay();
    scene.setTime(Number(slider.value));
  });
  $("play").addEventListener("click", () => {
    if (scene.autoPlayed) scene.stopAutoPlay();
    else scene.startAutoPlay();
  });
  scene.on(scene.events.AUTO_PLAY_CHANGE, (plays) => { $("play").textContent = plays ? "Pause" : "Play"; });
  for (const speed of [0.1, 0.25, 0.5, 1]) $("speed").append(new Option(speed + " x", speed));
  $("speed").addEventListener("change", () => {
    const plays = scene.autoPlayed;
    scene.stopAutoPlay();
    scene.setTimeSpeed(Number($("speed").value));
    if (plays) requestAnimationFrame(() => requestAnimationFrame(() => scene.startAutoPlay()));
  });
  $("speed").value = 0.25;
  scene.setTimeSpeed(0.25);

  // What is hidden.
  for (const part of ["flesh", "surfaces"]) {
    $(part).parentElement.hidden = data[part].length === 0;
    $(part).addEventListener("change", () => {
      for (const id of data[part]) scene.getObjectById(id).visible = $(part).checked;
      scene.render();
    });
  }

  // Curves. Plotly reads tags in names: they are escaped.
  const plain = (name) => name.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");
  const nonzero = (values) => values.some((x) => x !== null && Math.abs(x) > 1e-9);
  const lines = (values, x, keep) => values
    .map((y, j) => ({ x, y, name: plain(data.coordinates[j]), line: { width: 1.3 }, j }))
    .filter((one) => nonzero(one.y) && keep(one.j));
  const angle = (j) => data.angles[j], place = (j) => !data.angles[j];
  const ofMuscles = (make) => [...chosen].flatMap((i, k) => make(i, data.colors[k % data.colors.length]));
  const panels = () => [
    ["tracking error [deg]", lines(data.errors, data.time, angle)],
    ["tracking error [mm]", lines(data.errors, data.time, place)],
    ["excitation, activation (dotted)", ofMuscles((i, color) => [
      { x: data.ends, y: data.excitations[i], line: { color, width: 1.6, shape: "vh" }, name: plain(data.muscles[i]) + ": u" },
      { x: data.time, y: data.activations[i], line: { color, width: 1.3, dash: "dot" }, name: plain(data.muscles[i]) + ": a" },
    ])],
    ["force within its reach [N]", ofMuscles((i, color) => [
      { x: data.ends, y: data.low[i], line: { width: 0 }, hoverinfo: "skip" },
      { x: data.ends, y: data.high[i], line: { width: 0 }, fill: "tonexty", fillcolor: color + "28", hoverinfo: "skip" },
      { x: data.time, y: data.forces[i], line: { color, width: 1.6 }, name: plain(data.muscles[i]) },
    ])],
    ["unmet torque [N m] or force [N]", lines(data.unmet, data.ends, () => true)],
    ["torque of reserves [N m] or force [N]", lines(data.ideal, data.time, () => true)],
  ];
  const draw = async () => {
    const all = panels().filter(([title, traces]) => traces.length || !title.includes("error"));
    // Without curves there is a line that says so, and no more room for it.
    const weights = all.map(([, traces]) => (traces.length ? 1 : 0.12));
    const gap = 0.05, room = (1 - gap * (all.length - 1)) / weights.reduce((a, b) => a + b);
    const layout = {
      margin, showlegend: false, hovermode: "closest",
      font: { size: 11 }, annotations: [], paper_bgcolor: "#fff", plot_bgcolor: "#fff",
      xaxis: { range: [start, end], title: { text: "time [s]", standoff: 4 }, anchor: "free", position: 0, gridcolor: "#eee" },
    };
    const traces = [];
    let top = 1;
    all.forEach(([title, own], k) => {
      const height = room * weights[k], name = k ? String(k + 1) : "";
      layout["yaxis" + name] = {
        domain: [Math.max(0, top - height), top], zeroline: false, gridcolor: "#eee", nticks: 4,
        visible: own.length > 0, exponentformat: "none",
      };
      layout.annotations.push({
        text: own.length ? title : title + ": none", showarrow: false, xref: "paper", yref: "paper",
        x: 0, xanchor: "left", y: top, yanchor: "bottom", font: { size: 11, color: "#333" },
      });
      for (const one of own) traces.push({ mode: "lines", ...one, xaxis: "x", yaxis: "y" + name });
      top -= height + gap;
    });
    await Plotly.react($("curves"), traces, layout, { displayModeBar: false, responsive: true });
    cursor();
  };

  // Muscles are chosen in the list, by group, or by a click on them.
  const buttons = data.muscles.map((name, i) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = name;
    button.addEventListener("click", () => choose(chosen.has(i) ? [...chosen].filter((k) => k !== i) : [...chosen, i]));
    $("muscles").append(button);
    return button;
  });
  const choose = (wanted) => {
    chosen.clear();
    for (const i of wanted) chosen.add(i);
    buttons.forEach((button, i) => {
      const k = [...chosen].indexOf(i);
      button.setAttribute("aria-pressed", k >= 0);
      button.style.background = k >= 0 ? data.colors[k % data.colors.length] : "";
    });
    return draw();
  };
  const strongest = data.forces.map((force, i) => [Math.max(...force), i]).sort((a, b) => b[0] - a[0]);
  const every = data.muscles.map((_, i) => i);
  const groups = [["strongest five", strongest.slice(0, 5).map(([, i]) => i)], ["all muscles", every], ["none", []]];
  for (const [name, members] of Object.entries(data.groups)) {
    groups.push([name, members.map((member) => data.muscles.indexOf(member))]);
  }
  groups.forEach(([name], k) => $("group").append(new Option(name, k)));
  $("group").addEventListener("change", () => choose(groups[$("group").value][1]));
  $("filter").addEventListener("input", () => {
    const wanted = $("filter").value.toLowerCase();
    buttons.forEach((button, i) => { button.hidden = !data.muscles[i].toLowerCase().includes(wanted); });
  });
  // k3d looks for what was hit in trees of the shapes, which it does not keep up when they move.
  $("scene").addEventListener("pointerdown", () => {
    for (const id of data.bodies) {
      const tree = id && scene.getObjectById(id).geometry.boundsTree;
      if (tree) tree.refit();
    }
  }, true);
  scene.on(scene.events.OBJECT_CLICKED, (hit) => {
    const i = data.bodies.indexOf(hit.K3DIdentifier);
    if (i >= 0) choose([i]);
  });

  $("title").textContent = data.title;
  $("status").textContent = data.status + ", " + data.muscles.length + " muscles, " + data.coordinates.length + " coordinates";
  await choose(groups[0][1]);
  $("curves").on("plotly_relayout", cursor);
  $("curves").on("plotly_click", (hit) => { scene.stopAutoPlay(); scene.setTime(hit.points[0].x); });
  new ResizeObserver(cursor).observe($("curves"));
  new ResizeObserver(() => scene.resizeHelper()).observe($("scene"));
  scene.setTime(start);
  window.report = { scene, data, chosen };
  document.body.dataset.ready = "yes";
})();
