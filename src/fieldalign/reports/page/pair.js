// Two clouds in 3D. The source moves along the screw motion from where it came from to where the result takes it.
// A page may hold many scenes, each a pair; the event "choose" shows another one.
"use strict";
(() => {
  const $ = (id) => document.getElementById(id);
  const { scenes } = (globalThis.report ??= JSON.parse($("data").textContent));
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const PLAYED = 1600; // milliseconds from before to after
  const CLOUDS = ["source", "target"];

  const stage = stageIn($("viewer"));
  if (!stage) return;
  const { layers } = stage;
  const camera = cameraOn(stage, CLOUDS);

  let data = null; // of the scene that is shown
  let colouring = "cloud";

  const load = (number) => {
    stage.clear();
    data = scenes[number];
    for (const name of CLOUDS) stage.add(name, data.clouds[name]);
    if (data.pseudo) {
      stage.add("pseudo", data.pseudo, { spacing: 1.4 * Math.max(...CLOUDS.map((name) => data.clouds[name].spacing)) });
    }
    for (const [name, { object }] of layers) object.visible = $(`show-${name}`).checked;
    describe();
    camera.aim(data);
    pose = 0;
    hideCeiling(!$("show-ceiling").checked);
    colour(colouring);
    place(1);
    stage.recolour();
  };

  // What the page says of the scene, and the controls that only some scenes have.
  const describe = () => {
    for (const [name, word] of Object.entries(data.words)) {
      for (const element of document.querySelectorAll(`[data-word=${name}]`)) element.textContent = word;
    }
    stage.canvas.setAttribute("aria-label", data.words.story);
    document.querySelector("[data-legend=distance]").classList.toggle("one-sided", !data.signed);
    $("pseudo-label").hidden = !data.pseudo;
    $("pseudo-legend").hidden = !data.pseudo || !$("show-pseudo").checked;
    $("ceiling-label").hidden = data.ceiling === null;
    $("pose-label").hidden = data.motions.length === 1;
    $("pose").replaceChildren(...data.motions.map(({ name }, k) => new Option(name, k)));
  };

  // ---- The motion

  // Exp of a twist (w, v), by Rodrigues' formula, as a matrix.
  const exp = (twist) => {
    const w = new THREE.Vector3(...twist.slice(0, 3));
    const v = new THREE.Vector3(...twist.slice(3));
    const angle = w.length();
    const T = new THREE.Matrix4();
    if (angle > 1e-12) T.makeRotationAxis(w.clone().normalize(), angle);
    const a = angle > 1e-4 ? (1 - Math.cos(angle)) / angle ** 2 : 0.5;
    const b = angle > 1e-4 ? (angle - Math.sin(angle)) / angle ** 3 : 1 / 6;
    const wv = w.clone().cross(v);
    return T.setPosition(v.addScaledVector(wv, a).addScaledVector(w.clone().cross(wv), b));
  };

  const moved = (part) => {
    const { twist, growth } = data.motions[pose];
    const [x, y, z] = data.pivot;
    const s = growth ** part;
    const grown = new THREE.Matrix4().makeTranslation(x, y, z).scale(new THREE.Vector3(s, s, s))
      .multiply(new THREE.Matrix4().makeTranslation(-x, -y, -z));
    return exp(twist.map((value) => value * part)).multiply(grown);
  };

  let pose = 0;
  let share = 1;
  const place = (to) => {
    share = to;
    const grown = data.motions[pose].growth ** share;
    for (const [name, { object, uniforms, local, spacing }] of layers) {
      const moves = name === "source" || (name === "pseudo" && data.pseudo.of === "source");
      uniforms.size.value = moves ? grown * spacing : spacing;
      object.matrix.copy(moves ? moved(share).multiply(local) : local);
      uniforms.after.value.copy(moves ? moved(1).multiply(local) : local);
      object.matrixWorldNeedsUpdate = true;
    }
    const words = share === 0 ? "before" : share === 1 ? "after" : `${Math.round(100 * share)} %`;
    $("between").value = Math.round(100 * share);
    $("between").setAttribute("aria-valuetext", words);
    $("where").textContent = words;
    camera.frame();
    stage.draw();
  };

  let playing = 0;
  const play = () => {
    cancelAnimationFrame(playing);
    if (calm) return place(share < 1 ? 1 : 0);
    const begun = performance.now();
    const step = (now) => {
      const t = Math.min(Math.max((now - begun) / PLAYED, 0), 1);
      place(t * t * (3 - 2 * t));
      if (t < 1) playing = requestAnimationFrame(step);
    };
    playing = requestAnimationFrame(step);
  };
  const stop = (to) => {
    cancelAnimationFrame(playing);
    place(to);
  };

  // ---- The controls

  const colour = (name) => {
    colouring = name;
    for (const cloud of CLOUDS) layers.get(cloud).uniforms.colouring.value = COLOURINGS.indexOf(name);
    document.querySelector(`[name=colour][value=${name}]`).checked = true;
    for (const legend of document.querySelectorAll("[data-legend]")) legend.hidden = legend.dataset.legend !== name;
    stage.draw();
  };

  const show = (name, shown) => {
    layers.get(name).object.visible = shown;
    $(`show-${name}`).checked = shown;
    if (name === "pseudo") $("pseudo-legend").hidden = !shown;
    camera.frame();
    stage.draw();
  };

  const hideCeiling = (hidden) => {
    stage.hideAbove(hidden ? data.ceiling : null);
    camera.frame();
    stage.draw();
  };

  $("play").addEventListener("click", play);
  $("between").addEventListener("input", (event) => stop(event.target.value / 100));
  for (const radio of document.querySelectorAll("[name=colour]")) {
    radio.addEventListener("change", () => colour(radio.value));
  }
  for (const name of [...CLOUDS, "pseudo"]) {
    $(`show-${name}`).addEventListener("change", (event) => show(name, event.target.checked));
  }
  $("show-ceiling").addEventListener("change", (event) => hideCeiling(!event.target.checked));
  $("pose").addEventListener("change", (event) => {
    pose = Number(event.target.value);
    if (pose) colour("cloud"); // the other colours are those of the result
    stop(1);
  });

  const kinds = COLOURINGS.slice(0, 3);
  const nextColouring = () => colour(kinds[(kinds.indexOf(colouring) + 1) % kinds.length]);
  const toggle = (name) => layers.has(name) && show(name, !layers.get(name).object.visible);
  listen(stage, {
    ...camera.keys, b: () => stop(0), a: () => stop(1), c: nextColouring,
    s: () => toggle("source"), t: () => toggle("target"), p: () => toggle("pseudo"),
  }, { " ": play });

  addEventListener("recolour", stage.recolour);
  addEventListener("choose", (event) => {
    cancelAnimationFrame(playing);
    atHand = stage;
    load(event.detail);
  });
  if (!$("pairs")) load(0); // where there is a table, it chooses
  camera.resize();
})();
