// Two clouds in 3D. The source moves along the screw motion from where it came from to where the result takes it.
// A page may hold many scenes, each a pair; the event "choose" shows another one.
"use strict";
(() => {
  const $ = (id) => document.getElementById(id);
  const { scenes } = JSON.parse($("data").textContent);
  const canvas = $("canvas");
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const PLAYED = 1600; // milliseconds from before to after
  const FIELD = 35; // degrees that the camera sees from top to bottom
  const WITNESSES = 500; // places of each cloud
  const STRAYS = 0.004; // the share of them that may lie out of the picture on each side
  const MARGIN = 1.08;
  const COLOURINGS = ["cloud", "agreement", "distance"];

  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
  } catch {
    $("viewer").classList.add("off");
    return;
  }

  // ---- Clouds

  const unpacked = (text, Type) => {
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    return new Type(bytes.buffer);
  };

  const VERTEX = `
    attribute float state, distance;
    uniform int colouring;
    uniform vec3 own, alone, contradicts, agrees, inside, on, outside, up;
    uniform mat4 after;
    uniform float size, scale, ceiling;
    varying vec3 colour;
    void main() {
      vec4 place = modelViewMatrix * vec4(position, 1.0);
      gl_Position = projectionMatrix * place;
      if (dot(up, (after * vec4(position, 1.0)).xyz) > ceiling) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
      gl_PointSize = clamp(size * scale / -place.z, 1.6, 14.0);
      colour = own;
      if (colouring == 1) colour = state < 0.5 ? alone : state < 1.5 ? contradicts : agrees;
      if (colouring == 2) colour = state < 0.5 ? alone : mix(on, distance < 0.0 ? inside : outside, abs(distance));
      float facing = length(normal) > 0.1 ? abs(dot(normalize(normalMatrix * normal), normalize(place.xyz))) : 1.0;
      colour *= 0.7 + 0.3 * facing;
    }`;
  const FRAGMENT = `
    varying vec3 colour;
    void main() {
      vec2 off = gl_PointCoord - 0.5;
      if (dot(off, off) > 0.25) discard;
      gl_FragColor = vec4(colour, 1.0);
    }`;

  const shared = {
    colouring: { value: 0 }, scale: { value: 1 }, ceiling: { value: Infinity },
    up: { value: new THREE.Vector3() },
    alone: { value: new THREE.Color() }, contradicts: { value: new THREE.Color() }, agrees: { value: new THREE.Color() },
    inside: { value: new THREE.Color() }, on: { value: new THREE.Color() }, outside: { value: new THREE.Color() },
  };

  const scene = new THREE.Scene();
  const places = (packed) => new THREE.Matrix4().makeTranslation(...packed.centre).multiply(
    new THREE.Matrix4().makeScale(packed.half, packed.half, packed.half));

  // One object: its points, what makes places of 16-bit steps, and whose motion it follows.
  const added = (packed, of, spacing) => {
    const geometry = new THREE.BufferGeometry();
    const points = unpacked(packed.points, Int16Array);
    const count = points.length / 3;
    const bytes = (text, Type) => (text ? unpacked(text, Type) : new Type(count));
    const normals = packed.normals ? unpacked(packed.normals, Int8Array) : new Int8Array(3 * count);
    geometry.setAttribute("position", new THREE.BufferAttribute(points, 3, true));
    geometry.setAttribute("normal", new THREE.BufferAttribute(normals, 3, true));
    geometry.setAttribute("state", new THREE.BufferAttribute(bytes(packed.states, Uint8Array), 1));
    geometry.setAttribute("distance", new THREE.BufferAttribute(bytes(packed.distances, Int8Array), 1, true));
    const uniforms = {
      ...shared, own: { value: new THREE.Color() }, size: { value: spacing }, after: { value: new THREE.Matrix4() },
    };
    const material = new THREE.ShaderMaterial({ vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms });
    const object = new THREE.Points(geometry, material);
    object.matrixAutoUpdate = false;
    object.frustumCulled = false;
    scene.add(object);
    return { object, uniforms, of, spacing, local: places(packed) };
  };

  let data = null; // of the scene that is shown
  let drawn = {};
  let witnesses = {}; // some places of each cloud, which stand for all where the camera is set up

  const load = (number) => {
    for (const { object } of Object.values(drawn)) {
      scene.remove(object);
      object.geometry.dispose();
      object.material.dispose();
    }
    data = scenes[number];
    const { source, target } = data.clouds;
    drawn = { source: added(source, "source", source.spacing), target: added(target, "target", target.spacing) };
    if (data.pseudo) {
      drawn.pseudo = added(data.pseudo, data.pseudo.of, 1.4 * Math.max(source.spacing, target.spacing));
      drawn.pseudo.uniforms.colouring = { value: 0 };
    }
    for (const name in drawn) drawn[name].object.visible = $(`show-${name}`).checked;
    witnesses = { source: some(drawn.source), target: some(drawn.target) };
    describe();
    aim();
    pose = 0;
    place(1);
    hideCeiling(!$("show-ceiling").checked);
    recolour();
  };

  const some = ({ object }) => {
    const { position } = object.geometry.attributes;
    const step = Math.max(1, Math.floor(position.count / WITNESSES));
    const found = [];
    for (let k = 0; k < position.count; k += step) found.push(new THREE.Vector3().fromBufferAttribute(position, k));
    return found;
  };

  // What the page says of the scene, and the controls that only some scenes have.
  const describe = () => {
    for (const [name, word] of Object.entries(data.words)) {
      for (const element of document.querySelectorAll(`[data-word=${name}]`)) element.textContent = word;
    }
    canvas.setAttribute("aria-label", data.words.story);
    document.querySelector("[data-legend=distance]").classList.toggle("one-sided", !data.signed);
    $("pseudo-label").hidden = !data.pseudo;
    $("pseudo-legend").hidden = !data.pseudo || !$("show-pseudo").checked;
    $("ceiling-label").hidden = data.ceiling === null;
    $("pose-label").hidden = data.motions.length === 1;
    $("pose").replaceChildren(...data.motions.map((_, k) => new Option(k ? `alternative ${k}` : "the result", k)));
  };

  // Colours stand once, in the style of the page; the legend's swatches tell them.
  const recolour = () => {
    const of = (css) => {
      const [r, g, b] = css.match(/[\d.]+/g).map(Number);
      return new THREE.Color(r / 255, g / 255, b / 255);
    };
    const swatch = (name) => of(getComputedStyle(document.querySelector(`.swatch.${name}`)).backgroundColor);
    for (const name of ["alone", "contradicts", "agrees"]) shared[name].value = swatch(name);
    for (const name in drawn) drawn[name].uniforms.own.value = swatch(name);
    const probe = document.createElement("i");
    document.body.append(probe);
    for (const name of ["inside", "on", "outside"]) {
      probe.className = `colour-${name}`;
      shared[name].value = of(getComputedStyle(probe).color);
    }
    probe.remove();
    draw();
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

  const moved = (share) => {
    const { twist, growth } = data.motions[pose];
    const [x, y, z] = data.pivot;
    const s = growth ** share;
    const grown = new THREE.Matrix4().makeTranslation(x, y, z).scale(new THREE.Vector3(s, s, s))
      .multiply(new THREE.Matrix4().makeTranslation(-x, -y, -z));
    return exp(twist.map((value) => value * share)).multiply(grown);
  };

  let pose = 0;
  let share = 1;
  const place = (to) => {
    share = to;
    const grown = data.motions[pose].growth ** share;
    for (const { object, uniforms, of, local, spacing } of Object.values(drawn)) {
      uniforms.size.value = of === "source" ? grown * spacing : spacing;
      object.matrix.copy(of === "source" ? moved(share).multiply(local) : local);
      uniforms.after.value.copy(of === "source" ? moved(1).multiply(local) : local);
      object.matrixWorldNeedsUpdate = true;
    }
    const words = share === 0 ? "before" : share === 1 ? "after" : `${Math.round(100 * share)} %`;
    $("between").value = Math.round(100 * share);
    $("between").setAttribute("aria-valuetext", words);
    $("where").textContent = words;
    frame();
    draw();
  };

  // ---- The camera

  const camera = new THREE.PerspectiveCamera(FIELD, 1, 0.1, 10);
  const up = new THREE.Vector3();
  let controls = null;
  let views = {};
  let gaze = null; // from what is looked at to the camera
  let radius = 1; // about how far all reaches, where the camera was set up last
  let framed = true; // the camera follows until somebody takes hold of it

  // Looks at the scene obliquely, its own vertical upwards.
  const aim = () => {
    up.set(...data.up);
    shared.up.value.copy(up);
    const side = new THREE.Vector3(...data.side);
    views = {
      oblique: new THREE.Vector3(...data.oblique),
      above: up.clone().addScaledVector(side, 1e-3),
      side: side.addScaledVector(up, 0.12),
    };
    gaze = views.oblique.clone().normalize();
    framed = true;
    controls?.dispose();
    camera.up.copy(up);
    controls = new THREE.OrbitControls(camera, canvas); // they keep the vertical that they are made with
    controls.zoomToCursor = true;
    controls.addEventListener("start", () => (framed = false));
    controls.addEventListener("change", () => draw());
  };

  // All that is shown at the present share of the motion, as seen along the gaze: right, up and towards the viewer.
  const seen = () => {
    const right = new THREE.Vector3().crossVectors(up, gaze).normalize();
    const above = new THREE.Vector3().crossVectors(gaze, right);
    const found = [];
    for (const name of ["source", "target"]) {
      const { object, uniforms } = drawn[name];
      if (!object.visible && drawn.source.object.visible !== drawn.target.object.visible) continue;
      for (const place of witnesses[name]) {
        if (place.clone().applyMatrix4(uniforms.after.value).dot(up) > shared.ceiling.value) continue;
        const at = place.clone().applyMatrix4(object.matrix);
        found.push([at.dot(right), at.dot(above), at.dot(gaze)]);
      }
    }
    return { right, above, found };
  };

  const between = (values) => {
    const sorted = values.toSorted((a, b) => a - b);
    const strays = Math.floor(STRAYS * (sorted.length - 1));
    return [sorted[strays], sorted[sorted.length - 1 - strays]];
  };

  // Lays the target of the camera in the middle of what is seen, and goes so near that all but strays fits in.
  const frame = () => {
    if (!framed) return;
    const { right, above, found } = seen();
    if (!found.length) return;
    const middle = (values) => between(values).reduce((low, high) => (low + high) / 2);
    const steep = Math.tan((FIELD / 2) * (Math.PI / 180));
    let [x, y, z] = [0, 1, 2].map((axis) => middle(found.map((place) => place[axis])));
    for (let again = 0; again < 3; again++) {
      const needed = found.map(([a, b, c]) =>
        c - z + Math.max(Math.abs(a - x) / (steep * camera.aspect), Math.abs(b - y) / steep));
      radius = Math.max(between(needed)[1], 1e-30);
      const depths = found.map((place) => Math.max(radius - place[2] + z, 0.1 * radius));
      x += radius * middle(found.map((place, k) => (place[0] - x) / depths[k])); // what is near looks larger
      y += radius * middle(found.map((place, k) => (place[1] - y) / depths[k]));
    }
    controls.target.set(0, 0, 0).addScaledVector(right, x).addScaledVector(above, y).addScaledVector(gaze, z);
    camera.position.copy(controls.target).addScaledVector(gaze, MARGIN * radius);
    controls.update();
  };

  const look = (name) => {
    gaze = name === "fit"
      ? camera.position.clone().sub(controls.target).normalize()
      : views[name].clone().normalize();
    framed = true;
    frame();
    draw();
  };

  const turn = (right, down, nearer) => {
    framed = false;
    const offset = camera.position.clone().sub(controls.target);
    const across = offset.clone().cross(up).normalize();
    offset.applyAxisAngle(up, right);
    const tilted = offset.clone().applyAxisAngle(across.applyAxisAngle(up, right), down);
    if (Math.abs(tilted.clone().normalize().dot(up)) < 0.995) offset.copy(tilted);
    camera.position.copy(controls.target).addScaledVector(offset, nearer);
    controls.update();
    draw();
  };

  // ---- Drawing, when something has changed

  let waiting = false;
  const draw = () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      const away = camera.position.distanceTo(controls.target);
      camera.near = Math.max(away - 4 * radius, Math.min(away, radius) / 200);
      camera.far = away + 4 * radius;
      camera.updateProjectionMatrix();
      renderer.render(scene, camera);
    });
  };

  const resize = () => {
    const { clientWidth: width, clientHeight: height } = canvas;
    if (!width || !height) return;
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    shared.scale.value = (renderer.domElement.height / 2) / Math.tan((FIELD / 2) * (Math.PI / 180));
    frame();
    draw();
  };

  // ---- The controls

  const colour = (name) => {
    shared.colouring.value = COLOURINGS.indexOf(name);
    document.querySelector(`[name=colour][value=${name}]`).checked = true;
    for (const legend of document.querySelectorAll("[data-legend]")) legend.hidden = legend.dataset.legend !== name;
    draw();
  };

  const show = (name, shown) => {
    drawn[name].object.visible = shown;
    $(`show-${name}`).checked = shown;
    if (name === "pseudo") $("pseudo-legend").hidden = !shown;
    frame();
    draw();
  };

  const hideCeiling = (hidden) => {
    shared.ceiling.value = hidden && data.ceiling !== null ? data.ceiling : 1e30;
    frame();
    draw();
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

  $("play").addEventListener("click", play);
  $("between").addEventListener("input", (event) => stop(event.target.value / 100));
  for (const radio of document.querySelectorAll("[name=colour]")) {
    radio.addEventListener("change", () => colour(radio.value));
  }
  for (const name of ["source", "target", "pseudo"]) {
    $(`show-${name}`).addEventListener("change", (event) => show(name, event.target.checked));
  }
  $("show-ceiling").addEventListener("change", (event) => hideCeiling(!event.target.checked));
  for (const button of document.querySelectorAll("[data-view]")) {
    button.addEventListener("click", () => look(button.dataset.view));
  }
  $("pose").addEventListener("change", (event) => {
    pose = Number(event.target.value);
    if (pose) colour("cloud"); // the other colours are those of the result
    stop(1);
  });

  const nextColouring = () => colour(COLOURINGS[(shared.colouring.value + 1) % COLOURINGS.length]);
  const toggle = (name) => drawn[name] && show(name, !drawn[name].object.visible);
  const KEYS = {
    b: () => stop(0), a: () => stop(1), c: nextColouring, f: () => look("fit"),
    1: () => look("oblique"), 2: () => look("above"), 3: () => look("side"),
    s: () => toggle("source"), t: () => toggle("target"), p: () => toggle("pseudo"),
  };
  const ON_CANVAS = {
    ArrowLeft: [-0.12, 0, 1], ArrowRight: [0.12, 0, 1], ArrowUp: [0, -0.12, 1], ArrowDown: [0, 0.12, 1],
    "+": [0, 0, 0.87], "=": [0, 0, 0.87], "-": [0, 0, 1.15],
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.matches("select, textarea, input[type=text]")) return;
    const free = event.target === canvas || event.target === document.body;
    if (event.target === canvas && ON_CANVAS[event.key]) {
      event.preventDefault();
      turn(...ON_CANVAS[event.key]);
    } else if (event.key === " " && free) {
      event.preventDefault();
      play();
    } else {
      KEYS[event.key.toLowerCase()]?.();
    }
  });

  addEventListener("recolour", recolour);
  addEventListener("choose", (event) => {
    cancelAnimationFrame(playing);
    load(event.detail);
  });
  new ResizeObserver(resize).observe(canvas);
  load(0);
  resize();
})();
