// The camera before a stage: it frames what is there, looks from where the buttons and keys say, and turns by hand.
"use strict";

const FIELD = 35; // degrees that the camera sees from top to bottom
const WITNESSES = 500; // places of each cloud, which stand for all where the camera is set up
const STRAYS = 0.004; // the share of them that may lie out of the picture on each side
const MARGIN = 1.08;
const TURNS = { // of the arrows: to the right, down (radians), and how much farther away
  ArrowLeft: [-0.12, 0, 1], ArrowRight: [0.12, 0, 1], ArrowUp: [0, -0.12, 1], ArrowDown: [0, 0.12, 1],
  "+": [0, 0, 0.87], "=": [0, 0, 0.87], "-": [0, 0, 1.15],
};
const AXES = { z: [0, 0, 1], "−y": [0, -1, 0], y: [0, 1, 0], "−z": [0, 0, -1], x: [1, 0, 0], "−x": [-1, 0, 0] };

// framed: the names of the layers that are to be seen.
const cameraOn = (stage, framed) => {
  const { root, canvas, renderer, layers, shared } = stage;
  const camera = new THREE.PerspectiveCamera(FIELD, 1, 0.1, 10);
  const steep = Math.tan((FIELD / 2) * (Math.PI / 180));
  const up = new THREE.Vector3();
  let controls = null;
  let data = null; // where the scene's vertical is, and from where to look
  let ups = []; // directions that may be upwards, the one in force first
  let views = {};
  let gaze = null; // from what is looked at to the camera
  let radius = 1; // about how far all reaches, where the camera was set up last
  let follows = true; // until somebody takes hold of the camera
  let fitted = ""; // the size that the picture has
  let witnesses = new Map();

  const some = ({ object }) => {
    const { position } = object.geometry.attributes;
    const step = Math.max(1, Math.floor(position.count / WITNESSES));
    const found = [];
    for (let k = 0; k < position.count; k += step) found.push(new THREE.Vector3().fromBufferAttribute(position, k));
    return found;
  };

  // Looks at another scene obliquely, its own vertical upwards.
  const aim = (scene) => {
    data = scene;
    witnesses = new Map(framed.filter((name) => layers.has(name)).map((name) => [name, some(layers.get(name))]));
    shared.upwards.value.set(...data.up);
    const own = ["as found", new THREE.Vector3(...data.up)];
    const others = Object.entries(AXES).map(([name, axis]) => [name, new THREE.Vector3(...axis)]);
    ups = [own, ...others.filter(([, axis]) => axis.angleTo(own[1]) > 0.35)];
    raise();
  };

  // Puts the first of the directions upwards: the views turn with it.
  const raise = () => {
    up.copy(ups[0][1]);
    const from = new THREE.Vector3(...data.up);
    const side = new THREE.Vector3(...data.side);
    const axis = from.clone().cross(up);
    if (axis.length() < 1e-6) axis.copy(side);
    const turned = (v) => v.applyAxisAngle(axis.normalize(), from.angleTo(up));
    turned(side);
    views = {
      oblique: turned(new THREE.Vector3(...data.oblique)),
      above: up.clone().addScaledVector(side, 1e-3),
      side: side.clone().addScaledVector(up, 0.12),
    };
    gaze = views.oblique.clone().normalize();
    follows = true;
    controls?.dispose();
    camera.up.copy(up);
    controls = new THREE.OrbitControls(camera, canvas); // they keep the vertical that they are made with
    controls.zoomToCursor = true;
    controls.addEventListener("start", () => (follows = false));
    controls.addEventListener("change", stage.draw);
  };

  const nextUp = () => {
    ups.push(ups.shift());
    const button = root.querySelector("[data-up]");
    button.textContent = `Up: ${ups[0][0]}`;
    button.setAttribute("aria-label", `Up: ${ups[0][0]}; turn another axis upwards`);
    raise();
    frame();
    stage.draw();
  };

  // All that is shown, as seen along the gaze: right, up and towards the viewer.
  const seen = () => {
    const right = new THREE.Vector3().crossVectors(up, gaze).normalize();
    const above = new THREE.Vector3().crossVectors(gaze, right);
    const found = [];
    const shown = [...witnesses.keys()].filter((name) => layers.get(name).object.visible);
    for (const name of shown.length ? shown : witnesses.keys()) {
      const { object, uniforms } = layers.get(name);
      for (const place of witnesses.get(name)) {
        const end = place.clone().applyMatrix4(uniforms.after.value);
        if (end.dot(shared.upwards.value) > shared.ceiling.value) continue;
        const at = place.clone().applyMatrix4(object.matrix);
        found.push([at.dot(right), at.dot(above), at.dot(gaze)]);
      }
    }
    return { right, above, found };
  };

  const between = (values) => {
    const sorted = Float64Array.from(values).sort();
    const strays = Math.floor(STRAYS * (sorted.length - 1));
    return [sorted[strays], sorted[sorted.length - 1 - strays]];
  };

  // Lays the target of the camera in the middle of what is seen, and goes so near that all but strays fits in.
  const frame = () => {
    if (!follows || !controls) return;
    const { right, above, found } = seen();
    if (!found.length) return;
    const middle = (values) => between(values).reduce((low, high) => (low + high) / 2);
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
    follows = true;
    frame();
    stage.draw();
  };

  const turn = (right, down, nearer) => {
    follows = false;
    const offset = camera.position.clone().sub(controls.target);
    const across = offset.clone().cross(up).normalize();
    offset.applyAxisAngle(up, right);
    const tilted = offset.clone().applyAxisAngle(across.applyAxisAngle(up, right), down);
    if (Math.abs(tilted.clone().normalize().dot(up)) < 0.995) offset.copy(tilted);
    camera.position.copy(controls.target).addScaledVector(offset, nearer);
    controls.update();
    stage.draw();
  };

  const resize = () => {
    const { clientWidth: width, clientHeight: height } = canvas;
    const ratio = Math.min(devicePixelRatio, 2);
    const size = [width, height, ratio].join();
    if (!width || !height || size === fitted) return;
    fitted = size;
    renderer.setPixelRatio(ratio);
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    shared.scale.value = renderer.domElement.height / 2 / steep;
    frame();
    stage.draw();
  };

  stage.camera = camera;
  stage.beforeDrawing = () => {
    const away = camera.position.distanceTo(controls.target);
    camera.near = Math.max(away - 4 * radius, Math.min(away, radius) / 200);
    camera.far = away + 4 * radius;
    camera.updateProjectionMatrix();
  };
  for (const button of root.querySelectorAll("[data-view]")) {
    button.addEventListener("click", () => look(button.dataset.view));
  }
  root.querySelector("[data-up]").addEventListener("click", nextUp);
  canvas.addEventListener("keydown", (event) => {
    if (!TURNS[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    turn(...TURNS[event.key]);
  });
  new ResizeObserver(resize).observe(canvas);
  const keys = { 1: () => look("oblique"), 2: () => look("above"), 3: () => look("side"), f: () => look("fit"), u: nextUp };
  return { aim, frame, resize, keys };
};

// Keys of a viewer, for when it is at hand: name of the key in small letters, and what it does. free: those that count
// only where nothing else has the focus.
const listen = (stage, keys, free = {}) => {
  document.addEventListener("keydown", (event) => {
    if (atHand !== stage || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.matches("select, textarea, input[type=text]")) return;
    keys[event.key.toLowerCase()]?.();
    if (free[event.key] && (event.target === stage.canvas || event.target === document.body)) {
      event.preventDefault();
      free[event.key]();
    }
  });
};
