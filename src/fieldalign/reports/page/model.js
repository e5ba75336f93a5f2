// One cloud in 3D, of many scans or of a drive, with ways as strings of beads on it: a line of WebGL's own is a pixel thin.
// A page may hold several such scenes, which share no frame; one is shown at a time.
"use strict";
(() => {
  const $ = (id) => document.getElementById(id);
  const { models } = (globalThis.report ??= JSON.parse($("data").textContent));
  const GOLDEN = 0.61803398875; // of the hues: successive scans differ, however many there are
  const HEIGHTS = [[0.21, 0.35, 0.63], [0.13, 0.57, 0.55], [0.37, 0.79, 0.38], [0.91, 0.77, 0.15]];
  const TOLD = 12; // scans that the legend names

  const stage = stageIn($("model"));
  if (!stage) return;
  const { layers } = stage;
  const camera = cameraOn(stage, ["cloud", "way"]);
  let data = null;
  let scans = null; // which one each point of the cloud is of
  let colouring = $("model").querySelector("[name=tint]:checked").value;

  const load = (number) => {
    stage.clear();
    data = models[number];
    for (const [name, packed] of Object.entries(data.layers)) stage.add(name, packed, packed);
    scans = data.layers.cloud?.scans ? unpacked(data.layers.cloud.scans, Uint16Array) : null;
    for (const [name, { object }] of layers) object.visible = $(`see-${name}`)?.checked ?? true;
    stage.canvas.setAttribute("aria-label", data.story);
    $("top-label").hidden = data.ceiling === null;
    $("see").hidden = data.ceiling === null && !$("model").querySelector("[data-layer]");
    $("scan")?.replaceChildren(new Option("all", ""), ...data.names.map((name, k) => new Option(name, k)));
    camera.aim(data);
    hideCeiling(!$("see-ceiling").checked);
    tint();
    stage.recolour();
  };

  // ---- Colours

  // The colour of a scan of this component, neither too light for a light page nor too dark for a dark one.
  const hue = (k) => {
    const isDark = Number(getComputedStyle(document.body).color.match(/\d+/)[0]) > 128;
    return new THREE.Color().setHSL((0.07 + k * GOLDEN) % 1, 0.62, (k % 2 ? 0.42 : 0.56) + (isDark ? 0.12 : 0));
  };

  const byScan = () => {
    const chosen = $("scan").value;
    const pale = styled("swatch alone", "backgroundColor");
    const palette = data.names.map((_, k) => (chosen === "" || Number(chosen) === k ? hue(k) : pale));
    return (k) => palette[scans[k]];
  };

  const byHeight = (count) => {
    const { position } = layers.get("cloud").object.geometry.attributes;
    const [x, y, z] = data.up;
    const heights = Float32Array.from({ length: count }, (_, k) =>
      x * position.getX(k) + y * position.getY(k) + z * position.getZ(k));
    const sorted = heights.slice().sort();
    const [low, high] = [0.01, 0.99].map((share) => sorted[Math.floor(share * (count - 1))]);
    const colours = HEIGHTS.map((rgb) => new THREE.Color(...rgb));
    const mixed = new THREE.Color();
    return (k) => {
      const at = Math.min(Math.max((heights[k] - low) / (high - low || 1), 0), 1) * (colours.length - 1);
      const below = Math.min(Math.floor(at), colours.length - 2);
      return mixed.lerpColors(colours[below], colours[below + 1], at - below);
    };
  };

  const tint = () => {
    if (scans) legend();
    const layer = layers.get("cloud");
    if (!layer) return;
    const { geometry } = layer.object;
    layer.uniforms.colouring.value = COLOURINGS.indexOf(colouring === "plain" ? "cloud" : "tint");
    if (colouring !== "plain") {
      const { count } = geometry.attributes.position;
      const of = (colouring === "scan" ? byScan : byHeight)(count);
      const bytes = new Uint8Array(3 * count);
      for (let k = 0; k < count; k++) {
        const { r, g, b } = of(k);
        bytes.set([255 * r, 255 * g, 255 * b], 3 * k);
      }
      geometry.setAttribute("tint", new THREE.BufferAttribute(bytes, 3, true));
    }
    for (const list of document.querySelectorAll("[data-tint]")) list.hidden = list.dataset.tint !== colouring;
    if ($("scan-label")) $("scan-label").hidden = colouring !== "scan";
    stage.draw();
  };

  // The scans that the legend has room for.
  const legend = () => {
    $("scans").replaceChildren(...(data.names.length > TOLD ? [] : data.names.map((name, k) => {
      const item = document.createElement("li");
      const swatch = document.createElement("i");
      swatch.className = "swatch";
      const { r, g, b } = hue(k);
      swatch.style.backgroundColor = `rgb(${255 * r} ${255 * g} ${255 * b})`;
      item.append(swatch, name);
      return item;
    })));
  };

  // ---- The controls

  const paint = (name) => {
    colouring = name;
    $("model").querySelector(`[name=tint][value=${name}]`).checked = true;
    tint();
  };
  const hideCeiling = (hidden) => {
    stage.hideAbove(hidden ? data.ceiling : null);
    camera.frame();
    stage.draw();
  };

  const radios = [...$("model").querySelectorAll("[name=tint]")];
  for (const radio of radios) radio.addEventListener("change", () => paint(radio.value));
  for (const box of $("model").querySelectorAll("[data-layer]")) {
    box.addEventListener("change", () => {
      const layer = layers.get(box.dataset.layer);
      if (layer) layer.object.visible = box.checked;
      camera.frame();
      stage.draw();
    });
  }
  $("see-ceiling").addEventListener("change", (event) => hideCeiling(!event.target.checked));
  $("scan")?.addEventListener("change", tint);
  $("component")?.addEventListener("change", (event) => load(Number(event.target.value)));

  const next = () => paint(radios[(radios.findIndex((radio) => radio.checked) + 1) % radios.length].value);
  listen(stage, { ...camera.keys, c: next });
  addEventListener("recolour", () => {
    tint();
    stage.recolour();
  });
  load(0);
  camera.resize();
})();
