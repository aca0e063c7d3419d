// Connects k3d, which shows and plays the scene, with plotly, which draws the curves.
"use strict";
(async () => {
  const $ = (id) => document.getElementById(id);
  const data = JSON.parse($("data").textContent);
  const bytes = (id) => {
    const text = atob($(id).textContent), found = new Uint8Array(text.length);
    for (let k = 0; k < text.length; k++) found[k] = text.charCodeAt(k);
    return found;
  };
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
  // In place of k3d's scene where there is no WebGL: time, and nothing to see or to play.
  const still = () => {
    const heard = [];
    const scene = {
      events: { TIME_CHANGE: "time" }, autoPlayed: false, getObjectById: () => ({ geometry: {} }),
      on: (event, call) => { if (event === "time") heard.push(call); },
      setTime: (t) => { for (const call of heard) call(t); },
    };
    for (const name of ["stopAutoPlay", "startAutoPlay", "setTimeSpeed", "render", "resizeHelper"]) scene[name] = () => {};
    $("scene").textContent = "This browser draws nothing in 3D (WebGL is off). The curves are complete.";
    $("play").disabled = true;
    return scene;
  };
  let scene;
  try {
    scene = await k3d.CreateK3DAndLoadBinarySnapshot(bytes("scene-source").buffer, $("scene"));
  } catch (error) {
    console.warn(error);
    scene = still();
  }

  // Time: k3d's is the only one; it begins with zero.
  const { results, start, end } = data;
  const chosen = new Set(), slider = $("time");
  Object.assign(slider, { min: start, max: end, step: (end - start) / 1000 || 1, value: start });
  let now = start;
  // A line above plotly's curves, in a layer of its own: one of plotly's would take 0.1 s to move,
  // and without the layer all curves are painted anew.
  const margin = { l: 52, r: 12, t: 22, b: 34 };
  let width = 0; // of the curves; asking for it lays out the page
  const cursor = () => {
    if (!$("curves").layout) return;
    const [low, high] = $("curves").layout.xaxis.range, place = (now - low) / (high - low);
    const left = margin.l + place * (width - margin.l - margin.r);
    $("cursor").style.transform = `translateX(${left}px)`;
    $("cursor").hidden = place < 0 || place > 1;
  };
  const show = (t) => {
    now = t;
    if (document.activeElement !== slider || scene.autoPlayed) slider.value = t;
    $("now").textContent = t.toFixed(3) + " s";
    cursor();
  };
  scene.on(scene.events.TIME_CHANGE, (t) => show(start + t));
  const go = (t) => scene.setTime(t - start);
  slider.addEventListener("input", () => {
    scene.stopAutoPlay();
    go(Number(slider.value));
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
    const ids = results.flatMap((result) => result[part]);
    $(part).parentElement.hidden = ids.length === 0;
    $(part).addEventListener("change", () => {
      for (const id of ids) scene.getObjectById(id).visible = $(part).checked;
      scene.render();
    });
  }

  // Curves. Plotly reads tags in names: they are escaped.
  const plain = (name) => name.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");
  const nonzero = (values) => values.some((x) => x !== null && Math.abs(x) > 1e-9);
  const dashes = ["solid", "dash", "dashdot", "longdash"];
  const tones = ["#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b", "#e377c2", "#7f7f7f", "#bcbd22", "#17becf"];
  // One result needs no name, several are told apart by their dashes.
  const of = (name, r) => plain(name) + (results.length > 1 ? ", " + plain(results[r].label) : "");
  const dash = (r) => dashes[r % dashes.length];
  const lines = (quantity, time, keep, names = data.coordinates) => results.flatMap((result, r) => result[quantity]
    .map((y, j) => ({
      x: result[time], y, name: of(names[j], r), j,
      line: { width: 1.3, color: tones[j % tones.length], dash: dash(r) },
    }))
    .filter((one) => nonzero(one.y) && keep(one.j)));
  // A few names are told in a title; of many a line says its own where it is pointed at.
  const named = (names) => (names.length > 6 ? "" : ": " + names.map((name, j) => `<span style="color:${tones[j]}">${plain(name)}</span>`).join(", "));
  const angle = (j) => data.angles[j], place = (j) => !data.angles[j];
  const ofMuscles = (make) => [...chosen].flatMap((i, k) => results.flatMap(
    (result, r) => make(result, i, data.colors[k % data.colors.length], of(data.muscles[i], r), r)));
  const panels = () => [
    ["tracking error [deg]", lines("errors", "time", angle)],
    ["tracking error [mm]", lines("errors", "time", place)],
    ["excitation, activation (dotted)", ofMuscles((result, i, color, name, r) => [
      { x: result.ends, y: result.excitations[i], line: { color, width: 1.6, shape: "vh", dash: dash(r) }, name: name + ": u" },
      { x: result.time, y: result.activations[i], line: { color, width: 1.3, dash: "dot" }, name: name + ": a" },
      ...(result.measured[i] ? [{ x: result.ends, y: result.measured[i], line: { width: 0 }, fill: "tozeroy", fillcolor: color + "28", name: name + ": EMG" }] : []),
    ])],
    ["force within its reach [N]", ofMuscles((result, i, color, name, r) => [
      { x: result.ends, y: result.low[i], line: { width: 0 }, hoverinfo: "skip" },
      { x: result.ends, y: result.high[i], line: { width: 0 }, fill: "tonexty", fillcolor: color + "28", hoverinfo: "skip" },
      { x: result.time, y: result.forces[i], line: { color, width: 1.6, dash: dash(r) }, name },
      ...[["least", "least"], ["largest", "most"]].filter(([end]) => result[end].length).map(([end, word]) => (
        { x: result.ends, y: result[end][i], line: { color, width: 0.8, dash: "dot" }, name: name + ": " + word + " that would have done" })),
    ])],
    ...(data.joints.length ? [["force in joints [N]" + named(data.joints), lines("loads", "load_time", () => true, data.joints)]] : []),
    ["unmet torque [N m] or force [N]", lines("unmet", "ends", () => true)],
    ["torque of reserves [N m] or force [N]", lines("ideal", "time", () => true)],
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
  const strongest = results[0].forces.map((force, i) => [Math.max(...force), i]).sort((a, b) => b[0] - a[0]);
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
  // k3d looks for what was hit in a tree of the shapes, which it does not keep up when they move.
  $("scene").addEventListener("pointerdown", () => {
    for (const { muscles } of results) {
      const tree = muscles && scene.getObjectById(muscles).geometry.boundsTree;
      if (tree) tree.refit();
    }
  }, true);
  scene.on(scene.events.OBJECT_CLICKED, (hit) => {
    const result = results.find(({ muscles }) => muscles === hit.K3DIdentifier);
    if (result) choose([result.starts.findLastIndex((first) => first <= hit.face[0])]);
  });

  const words = ["", " (dashed)", " (dash-dotted)", " (long dashes)"];
  $("title").textContent = results.map((one, r) => one.label + words[r % words.length]).join(" | ");
  $("status").textContent = results.map((one) => one.status).join(" | ") + ", " + data.muscles.length + " muscles, " + data.coordinates.length + " coordinates";
  await choose(groups[0][1]);
  $("curves").on("plotly_relayout", cursor);
  $("curves").on("plotly_click", (hit) => { scene.stopAutoPlay(); go(hit.points[0].x); });
  new ResizeObserver(() => {
    width = $("curves").clientWidth;
    cursor();
  }).observe($("curves"));
  new ResizeObserver(() => scene.resizeHelper()).observe($("scene"));
  go(start);
  window.report = { scene, data, chosen };
  document.body.dataset.ready = "yes";
})();
